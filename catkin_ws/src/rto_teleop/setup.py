"""Shows src/rto_teleop to ROS through catkin; not for use with pip."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=["rto_teleop"], package_dir={"": "src"}))
