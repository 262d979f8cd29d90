# SPDX-License-Identifier: Apache-2.0
from setuptools import find_packages, setup

package_name = "towtank_bag"

setup(
    name=package_name,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{package_name}"]),
        (f"share/{package_name}", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    maintainer="towtank developers",
    maintainer_email="towtank@example.org",
    description="Recorder and reader of MCAP bags",
    license="Apache-2.0",
    entry_points={"console_scripts": ["recorder = towtank_bag.recorder:main"]},
)
