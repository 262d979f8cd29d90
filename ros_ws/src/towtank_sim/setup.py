# SPDX-License-Identifier: Apache-2.0
from setuptools import find_packages, setup

package_name = "towtank_sim"

setup(
    name=package_name,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{package_name}"]),
        (f"share/{package_name}", ["package.xml"]),
    ],
    # a link to firmware/protocol/board.yaml, which lays out the bench frame
    package_data={package_name: ["board.yaml"]},
    install_requires=["setuptools"],
    zip_safe=False,
    maintainer="towtank developers",
    maintainer_email="towtank@example.org",
    description="The simulator nodes (plant and twin of one simulator) and the virtual bench",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "virtual_tank = towtank_sim.virtual_tank:main",
            "twin = towtank_sim.twin_node:main",
        ],
    },
)
