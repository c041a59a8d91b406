"""Shows src/naoqi_driver to ROS through catkin; not for use with pip."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=["naoqi_driver", "naoqi_driver.onboard"], package_dir={"": "src"}))
