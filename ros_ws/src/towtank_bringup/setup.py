# SPDX-License-Identifier: Apache-2.0
from glob import glob

from setuptools import find_packages, setup

package_name = "towtank_bringup"

setup(
    name=package_name,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{package_name}"]),
        (f"share/{package_name}", ["package.xml"]),
        (f"share/{package_name}/launch", glob("launch/*.launch.py")),
        # The rig files stand with the hardware; a trial finds them by name from here.
        (f"share/{package_name}/rigs", glob("../../../hardware/rigs/*.yaml")),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    maintainer="towtank developers",
    maintainer_email="towtank@example.org",
    description="The graph of a trial, the launch file and the towtank command",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "towtank = towtank_bringup.cli:main",
            "conduct = towtank_bringup.conduct:main",
        ]
    },
)
