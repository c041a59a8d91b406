"""Read by catkin_python_setup()."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(
    **generate_distutils_setup(
        packages=["telepresence_1"],
        package_dir={"": "src"},
        package_data={"telepresence_1": ["templates/*.html"]},
    )
)
