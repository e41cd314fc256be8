"""Installs servo_identify as an ament_python package."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

NAME = 'servo_identify'
# What it cannot do without; ROS itself comes by package.xml, or as wheels (requirements/).
REQUIRES = [
    'jinja2',
    'markupsafe',
    'mcap',
    'numba',
    'numpy>=1.26.4',
    'pyarrow',
    'pyyaml',
    'rich',
    'rosbags',
    'ruamel.yaml',
    'scipy',
    'servo_twin',
    'threadpoolctl',
]
EXTRAS = {
    'cluster': ['dask', 'distributed'],  # many fits and diagnoses on a Dask cluster
    'files': ['h5py', 'nptdms', 'openpyxl'],  # HDF5, MAT files of version 7.3, TDMS, spreadsheets
    'fmu': ['servo_twin[fmu]'],  # mechanisms that are FMUs
    'frames': ['pandas', 'xarray'],  # recordings as frames and data sets
    'learn': ['pysindy', 'torch'],  # friction and other laws as networks
    'protobuf': ['mcap-protobuf-support'],  # MCAP files with protobuf messages
    'plot': ['matplotlib'],  # pictures of curves, friction, the online estimator
    'view': ['servo_twin[view]'],  # the live view
}


def shared_files(folder):
    """Return the files below folder as setuptools' data_files, keeping their subfolders."""
    by_target = {}
    for path in sorted(Path(folder).rglob('*')):
        if path.is_file():
            below = path.parent.relative_to(Path(folder).parent)
            by_target.setdefault(f'share/{NAME}/{below}', []).append(str(path))
    return sorted(by_target.items())


setup(
    name=NAME,
    version=ElementTree.parse('package.xml').findtext('version'),
    description='Identification of servo models, and diagnosis of the sim-to-real gap.',
    license='Apache-2.0',
    maintainer='Servo twin maintainers',
    maintainer_email='maintainers@servo-twin.org',
    packages=find_packages(exclude=['tests']),
    package_data={'servo_identify': ['**/*.html', '**/*.css', '**/*.js', '**/*.yaml']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        *shared_files('launch'),
    ],
    python_requires='>=3.11',
    install_requires=REQUIRES,
    # `colcon test` looks here for pytest, and in setup.cfg for the tests
    extras_require=EXTRAS | {'test': ['pytest']},
    zip_safe=False,
    entry_points={
        'console_scripts': [
            'servo-identify = servo_identify.cli:main',
            'identify_node = servo_identify.nodes.identify_node:main',
        ],
    },
)
