/* A camera that can be unplugged and can freeze, for programs that are loaded with this library (LD_PRELOAD).
 *
 * The device is the path in FAKE_CAMERA; the file named by FAKE_CAMERA_STATE says what it does: "gone", "frozen", or a
 * grey level 0..255 to film. It answers the requests of Video4Linux that a reader with memory-mapped buffers makes:
 * 640x480, about 30 pictures a second, YUYV; or motion JPEG, the file in FAKE_CAMERA_JPEG, if there is one. Source of the requests: Linux, Documentation/userspace-api/media/v4l.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/select.h>
#include <sys/stat.h>
#include <unistd.h>

enum { WIDTH = 640, HEIGHT = 480, SIZE = WIDTH * HEIGHT * 2, BUFFERS = 4, GONE = -1, FROZEN = -2 };

static int device = -1;         /* the memory behind the buffers */
static int unplugged;           /* an open device that was gone once stays dead, as a real one does */
static int queue[64], queued;

#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

static int state(void) {
  char text[16] = "gone";
  FILE *file = fopen(getenv("FAKE_CAMERA_STATE"), "r");
  if (file) {
    if (!fgets(text, sizeof text, file)) strcpy(text, "gone");
    fclose(file);
  }
  if (!strncmp(text, "gone", 4)) return GONE;
  if (!strncmp(text, "frozen", 6)) return FROZEN;
  return atoi(text) & 255;
}

static int is_camera(const char *path) {
  const char *camera = getenv("FAKE_CAMERA");
  return camera && path && !strcmp(path, camera);
}

static int absent(void) {
  if (state() != GONE) return 0;
  errno = ENOENT;
  return -1;
}

static int open_camera(void) {
  if (absent()) return -1;
  device = memfd_create("camera", 0);
  if (device < 0 || ftruncate(device, (off_t)SIZE * BUFFERS)) return -1;
  unplugged = queued = 0;
  return device;
}

int open(const char *path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  mode_t mode = va_arg(rest, mode_t);
  va_end(rest);
  return is_camera(path) ? open_camera() : NEXT(open)(path, flags, mode);
}

int open64(const char *path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  mode_t mode = va_arg(rest, mode_t);
  va_end(rest);
  return is_camera(path) ? open_camera() : NEXT(open64)(path, flags, mode);
}

int close(int fd) {
  if (fd == device) device = -1;
  return NEXT(close)(fd);
}

int stat64(const char *path, struct stat64 *result) {
  if (!is_camera(path)) return NEXT(stat64)(path, result);
  memset(result, 0, sizeof *result);
  result->st_mode = S_IFCHR | 0660;
  return absent();
}

int access(const char *path, int mode) { return is_camera(path) ? absent() : NEXT(access)(path, mode); }

int select(int count, fd_set *in, fd_set *out, fd_set *other, struct timeval *timeout) {
  if (device >= 0 && in && device < count && FD_ISSET(device, in)) {
    long waited = 0, patience = timeout->tv_sec * 1000000 + timeout->tv_usec;
    while (state() == FROZEN && waited < patience) {
      usleep(20000);
      waited += 20000;
    }
    return state() != FROZEN;
  }
  return NEXT(select)(count, in, out, other, timeout);
}

static unsigned format_of_pixels(void) { return getenv("FAKE_CAMERA_JPEG") ? V4L2_PIX_FMT_MJPEG : V4L2_PIX_FMT_YUYV; }

static void film(struct v4l2_buffer *buffer, int level) {
  unsigned char *pixels = mmap(NULL, SIZE, PROT_READ | PROT_WRITE, MAP_SHARED, device, (off_t)buffer->index * SIZE);
  buffer->length = buffer->bytesused = SIZE;
  if (format_of_pixels() == V4L2_PIX_FMT_MJPEG) {
    FILE *file = fopen(getenv("FAKE_CAMERA_JPEG"), "r");
    buffer->bytesused = (unsigned)fread(pixels, 1, SIZE, file);
    fclose(file);
  } else {
    for (int i = 0; i < SIZE; i += 2) {
      pixels[i] = (unsigned char)level;
      pixels[i + 1] = 128;
    }
  }
  munmap(pixels, SIZE);
  buffer->flags = V4L2_BUF_FLAG_DONE;
}

static int answer(unsigned long request, void *data) {
  int now = state();
  if (now == GONE) unplugged = 1;
  if (unplugged) {
    errno = ENODEV;
    return -1;
  }
  switch (request) {
    case VIDIOC_QUERYCAP: {
      struct v4l2_capability *capability = data;
      memset(capability, 0, sizeof *capability);
      strcpy((char *)capability->driver, "fake");
      capability->capabilities = capability->device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
      return 0;
    }
    case VIDIOC_G_FMT:
    case VIDIOC_TRY_FMT:
    case VIDIOC_S_FMT: {
      struct v4l2_format *format = data;
      if (request == VIDIOC_S_FMT && format->fmt.pix.pixelformat != format_of_pixels()) {
        errno = EINVAL;
        return -1;
      }
      format->type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
      format->fmt.pix = (struct v4l2_pix_format){.width = WIDTH, .height = HEIGHT, .pixelformat = format_of_pixels(),
                                                 .field = V4L2_FIELD_NONE, .bytesperline = WIDTH * 2, .sizeimage = SIZE};
      return 0;
    }
    case VIDIOC_ENUMINPUT:
      return ((struct v4l2_input *)data)->index ? (errno = EINVAL, -1) : 0;
    case VIDIOC_G_INPUT:
      *(int *)data = 0;
      return 0;
    case VIDIOC_S_INPUT:
    case VIDIOC_G_PARM:
    case VIDIOC_S_PARM:
    case VIDIOC_STREAMON:
      return 0;
    case VIDIOC_STREAMOFF:
      queued = 0;
      return 0;
    case VIDIOC_REQBUFS: {
      struct v4l2_requestbuffers *buffers = data;
      if (buffers->count > BUFFERS) buffers->count = BUFFERS;
      return 0;
    }
    case VIDIOC_QUERYBUF: {
      struct v4l2_buffer *buffer = data;
      buffer->length = SIZE;
      buffer->m.offset = buffer->index * SIZE;
      return 0;
    }
    case VIDIOC_QBUF:
      if (queued < 64) queue[queued++] = (int)((struct v4l2_buffer *)data)->index;
      return 0;
    case VIDIOC_DQBUF: {
      struct v4l2_buffer *buffer = data;
      if (!queued || now == FROZEN) {
        errno = EAGAIN;
        return -1;
      }
      usleep(33000);
      buffer->index = (unsigned)queue[0];
      memmove(queue, queue + 1, sizeof queue[0] * (size_t)--queued);
      film(buffer, now);
      return 0;
    }
    default:
      errno = EINVAL;
      return -1;
  }
}

int ioctl(int fd, unsigned long request, ...) {
  va_list rest;
  va_start(rest, request);
  void *data = va_arg(rest, void *);
  va_end(rest);
  return fd == device && device >= 0 ? answer(request, data) : NEXT(ioctl)(fd, request, data);
}
