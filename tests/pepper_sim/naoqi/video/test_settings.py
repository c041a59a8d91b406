"""ALVideoDevice's cameras and parameters over the wire."""

import math

import pytest


def test_cameras(naoqi, refused):
    video = naoqi.ALVideoDevice
    assert video.getCameraIndexes() == [0, 1, 2]
    assert [video.getCameraName(i) for i in range(3)] == ["CameraTop", "CameraBottom", "CameraDepth"]
    assert [video.getCameraModel(i) for i in range(3)] == [3, 3, 4]
    assert video.hasDepthCamera() is True
    assert "camera 7" in refused(video.getCameraName, 7)


def test_fields_of_view_are_the_documented_ones(naoqi):
    video = naoqi.ALVideoDevice
    assert math.degrees(video.getHorizontalFOV(0)) == pytest.approx(57.2, abs=0.5)
    assert math.degrees(video.getVerticalFOV(0)) == pytest.approx(44.3, abs=0.1)
    assert math.degrees(video.getHorizontalFOV(2)) == pytest.approx(58.0, abs=0.5)


def test_parameters_have_ranges_and_defaults(naoqi, refused):
    video = naoqi.ALVideoDevice
    assert video.getParameterRange(0, 0) == [-255, 255]
    assert video.setParameter(0, 1, 100) and video.getParameter(0, 1) == 100
    assert video.getParameter(1, 1) == 32, "each camera has its own"
    assert video.setParameterToDefault(0, 1) and video.getParameter(0, 1) == 32
    assert video.setParameter(0, 43, 50) and "multiple" in refused(video.setParameter, 0, 43, 51)
    assert video.getParameter(0, 999) == 0xDEAD404
    assert "newValue" in refused(video.setParameter, 0, 0, 1000)
    assert "999" in refused(video.setParameter, 0, 999, 1)
    video.setAllParametersToDefault(0)


def test_parameters_by_handle_and_of_the_active_camera(naoqi, refused):
    video = naoqi.ALVideoDevice
    handle = video.subscribeCamera("params", 1, 1, 11, 5)
    assert video.setCameraParameter(handle, 0, 7) and video.getParameter(1, 0) == 7
    assert video.getCameraParameter(handle, 0) == 7 and video.getCameraParameterRange(handle, 0) == [-255, 255]
    assert video.setCameraParameterToDefault(handle, 0) and video.setAllCameraParametersToDefault(handle)
    video.unsubscribe(handle)
    video.setParam(0, 9)
    assert video.getParam(0) == 9 == video.getParameter(0, 0)
    video.setParamDefault(0)
    assert video.getParam(0) == 0
    assert "params" in refused(video.getCameraParameter, "params", 0)


def test_picture_positions_and_angles_are_inverse(naoqi, refused):
    video = naoqi.ALVideoDevice
    assert video.getAngularPositionFromImagePosition(0, [0.5, 0.5]) == pytest.approx([0.0, 0.0])
    left, up = video.getAngularPositionFromImagePosition(0, [0.0, 0.0])
    assert left == pytest.approx(video.getHorizontalFOV(0) / 2, rel=1e-5)
    assert up == pytest.approx(-video.getVerticalFOV(0) / 2, rel=1e-5)
    assert video.getImagePositionFromAngularPosition(0, [left, up]) == pytest.approx([0.0, 0.0], abs=1e-5)
    assert "imagePosition" in refused(video.getAngularPositionFromImagePosition, 0, [0.5])
    size = video.getAngularSizeFromImageSize(0, [1.0, 0.5])
    assert size[0] == pytest.approx(video.getHorizontalFOV(0), rel=1e-5)
    assert video.getImageSizeFromAngularSize(0, size) == pytest.approx([1.0, 0.5], rel=1e-5)
    info = video.getImageInfoFromAngularInfoWithResolution(0, [left, up, *size], 2)
    assert info == pytest.approx([0.0, 0.0, 640.0, 240.0], abs=0.01)
    assert video.getImgInfoFromAngInfoWithRes([left, up, *size], 2) == pytest.approx(info)
