"""The Python package: CMake builds the extension, setuptools packs it. Offline: pip install . --no-build-isolation."""

import os
import re
import shutil
import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent
VERSION = re.search(r"project\(canyon VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text())[1]


class BuildByCMake(build_ext):
    """Builds the one extension, in CANYON_PYTHON_BUILD where that names a build folder of this source.

    That folder is configured for this Python where it was for another one.
    """

    def build_extension(self, extension):
        target = Path(self.get_ext_fullpath(extension.name)).resolve()
        target.parent.mkdir(parents=True, exist_ok=True)
        ready = os.environ.get("CANYON_PYTHON_BUILD")
        build = Path(ready or self.build_temp).resolve()
        options = [f"-DPython3_EXECUTABLE={sys.executable}", "-DCANYON_BUILD_PYTHON=ON"]
        if find_spec("pybind11"):  # pip's, which knows the newest Pythons
            options.append("-Dpybind11_DIR=" + import_module("pybind11").get_cmake_dir())
        if not ready:
            generator = ["-G", "Ninja"] if shutil.which("ninja") else []
            options += [*generator, "-DCMAKE_BUILD_TYPE=Release", "-DCANYON_BUILD_TESTS=OFF", "-DCANYON_BUILD_CLI=OFF",
                        "-DCANYON_BUILD_BENCHMARKS=OFF", "-DCANYON_BUILD_GZ_SIM=OFF", "-DCANYON_BUILD_ROS2=OFF"]
        if not (ready and (build / "python" / "canyon" / target.name).exists()):
            subprocess.run(["cmake", "-S", str(ROOT), "-B", str(build), "-U*Python3_*", "-Upybind11_*", *options], check=True)
        subprocess.run(["cmake", "--build", str(build), "--target", "canyon_python"], check=True)
        built = build / "python" / "canyon"
        shutil.copyfile(built / target.name, target)
        if not self.inplace:  # the source keeps its stub, which has the types alone
            shutil.copyfile(built / "_canyon.pyi", target.with_name("_canyon.pyi"))


setup(
    name="canyon-gnss",  # another project may have the name of the package and the command, canyon
    version=VERSION,
    description="Emulator of what a GNSS receiver sees in a city",
    long_description=(ROOT / "docs" / "python.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    license="Apache-2.0",
    classifiers=[
        "Development Status :: 4 - Beta",
        "Intended Audience :: Science/Research",
        "License :: OSI Approved :: Apache Software License",
        "Operating System :: POSIX :: Linux",
        "Programming Language :: C++",
        "Programming Language :: Python :: 3",
        "Topic :: Scientific/Engineering",
        "Typing :: Typed",
    ],
    python_requires=">=3.9",
    install_requires=["numpy"],
    extras_require={"tables": ["pandas", "xarray"]},
    package_dir={"": "python"},
    packages=["canyon"],
    package_data={"canyon": ["py.typed", "*.pyi"]},
    ext_modules=[Extension("canyon._canyon", sources=[])],
    cmdclass={"build_ext": BuildByCMake},
)
