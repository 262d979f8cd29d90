# SPDX-License-Identifier: Apache-2.0
from setuptools import find_packages, setup

package_name = "towtank_compare"

setup(
    name=package_name,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    package_data={package_name: ["templates/*.j2"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{package_name}"]),
        (f"share/{package_name}", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    zip_safe=False,
    maintainer="towtank developers",
    maintainer_email="towtank@example.org",
    description="Heave ratios live and from bags, with uncertainty, and the report of a trial",
    license="Apache-2.0",
    entry_points={"console_scripts": ["comparison = towtank_compare.comparison:main"]},
)
