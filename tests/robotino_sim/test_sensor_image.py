import cv2
import numpy as np

from robotino_sim.sensor_image import SIZE, draw_sensors


def decoded(*arguments):
    return cv2.imdecode(np.frombuffer(draw_sensors(*arguments), np.uint8), cv2.IMREAD_COLOR)


def reddish(picture):
    blue, green, red = (picture[..., i].astype(int) for i in range(3))
    return red - np.maximum(blue, green) > 60


def test_is_a_png_of_its_size():
    data = draw_sensors([0.41] * 9, False)
    assert data.startswith(b"\x89PNG")
    assert decoded([0.41] * 9, False).shape == (SIZE, SIZE, 3)


def test_obstacle_ahead_is_red_above_the_robot():
    near = decoded([0.08] + [0.41] * 8, False)
    rows, columns = np.nonzero(reddish(near))
    assert rows.size and rows.max() < SIZE / 2
    assert abs(columns.mean() - SIZE / 2) < 5


def test_obstacle_at_the_left_is_left():
    """Sensor 2 points 80 degrees to the left."""
    near = decoded([0.41, 0.41, 0.08] + [0.41] * 6, False)
    _, columns = np.nonzero(reddish(near))
    assert columns.size and columns.max() < SIZE / 2


def test_bumper_draws_a_red_ring():
    pressed = reddish(decoded([0.41] * 9, True))
    assert pressed.sum() > 1000 and not reddish(decoded([0.41] * 9, False)).any()
    assert np.allclose(np.mean(np.nonzero(pressed), axis=1), SIZE / 2, atol=2)
