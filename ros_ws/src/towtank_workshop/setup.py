# SPDX-License-Identifier: Apache-2.0
from setuptools import find_packages, setup

package_name = "towtank_workshop"

setup(
    name=package_name,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{package_name}"]),
        (f"share/{package_name}", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    zip_safe=False,
    maintainer="towtank developers",
    maintainer_email="towtank@example.org",
    description="What a workshop needs of a rig: drawings, masses, check list",
    license="Apache-2.0",
)
