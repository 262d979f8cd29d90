# SPDX-License-Identifier: Apache-2.0
from setuptools import find_packages, setup

package_name = "towtank_daq"

setup(
    name=package_name,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{package_name}"]),
        (f"share/{package_name}", ["package.xml"]),
        # a link to firmware/protocol/board.yaml, the one description of the protocol
        (f"share/{package_name}/protocol", ["protocol/board.yaml"]),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    maintainer="towtank developers",
    maintainer_email="towtank@example.org",
    description="ADC board driver and sensor nodes",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "acquisition = towtank_daq.acquisition:main",
            "adc_board = towtank_daq.adc_board_node:main",
            "sensors = towtank_daq.sensors:main",
        ],
    },
)
