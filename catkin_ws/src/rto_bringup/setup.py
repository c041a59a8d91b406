"""Shows src/rto_bringup to ROS through catkin; not for use with pip."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=["rto_bringup", "rto_bringup.onboard"], package_dir={"": "src"}))
