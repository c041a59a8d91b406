// @ts-check
/** The way without WebRTC: one websocket carries the messages of all channels and, as JPEG files, the pictures. They
 * are painted into a stream, so that the rest of the page sees no difference. See telepresence/page/browser_socket.py. */

/** What the page uses of an RTCDataChannel. */
export class Channel {
  /** @param {WebSocket} socket @param {string} kind of messages */
  constructor(socket, kind) {
    this.socket = socket;
    this.kind = kind;
    /** @type {((event: {data: string}) => void) | null} */
    this.onmessage = null;
  }

  get readyState() {
    return this.socket.readyState === WebSocket.OPEN ? "open" : "closed";
  }

  get bufferedAmount() {
    return this.socket.bufferedAmount;
  }

  /** @param {string} message */
  send(message) {
    this.socket.send(`${this.kind} ${message}`);
  }
}

export class Slower {
  /** @param {string} robot @param {string} page its name @param {number} attempt */
  constructor(robot, page, attempt) {
    this.canvas = document.createElement("canvas");
    this.context = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext("2d", { alpha: false }));
    this.stream = this.canvas.captureStream();
    const url = new URL(`ws?robot=${encodeURIComponent(robot)}&page=${page}&attempt=${attempt}`, document.baseURI);
    url.protocol = "wss:";
    this.socket = new WebSocket(url);
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = (event) => this.onMessage(event.data);
    /** @type {Record<string, Channel>} */
    this.channels = {};
    this.stamp = 0; // when the newest picture was taken [s since 1970, by the station's clock]
  }

  get open() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  /** @param {string} kind */
  channel(kind) {
    return (this.channels[kind] ??= new Channel(this.socket, kind));
  }

  close() {
    this.socket.onmessage = null;
    this.socket.close();
    for (const track of this.stream.getTracks()) track.stop();
  }

  /** @param {string | ArrayBuffer} data */
  onMessage(data) {
    if (typeof data !== "string") {
      this.show(data);
      return;
    }
    const kind = data.slice(0, data.indexOf(" "));
    this.channels[kind]?.onmessage?.({ data: data.slice(kind.length + 1) });
  }

  /** @param {ArrayBuffer} data */
  async show(data) {
    const picture = await createImageBitmap(new Blob([data.slice(8)], { type: "image/jpeg" }));
    if (this.canvas.width !== picture.width) this.canvas.width = picture.width;
    if (this.canvas.height !== picture.height) this.canvas.height = picture.height;
    this.context.drawImage(picture, 0, 0);
    picture.close();
    this.stamp = new DataView(data).getFloat64(0);
    if (this.open) this.socket.send("seen"); // the next one may come
  }
}
