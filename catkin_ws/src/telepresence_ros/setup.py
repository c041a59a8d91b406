"""Shows src/telepresence_ros to ROS through catkin; not for use with pip."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=["telepresence_ros"], package_dir={"": "src"}))
