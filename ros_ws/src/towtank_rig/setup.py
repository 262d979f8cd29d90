# SPDX-License-Identifier: Apache-2.0
from setuptools import find_packages, setup

PACKAGE = "towtank_rig"

setup(
    name=PACKAGE,
    version="0.1.0",
    description="Rig files of towtank: schema, loading, sensor conversion.",
    author="towtank maintainers",
    license="Apache-2.0",
    packages=find_packages(exclude=["test"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    install_requires=["setuptools", "numpy", "pydantic>=2", "PyYAML"],
    zip_safe=True,
)
