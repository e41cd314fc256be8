"""Installs servo_rig_driver as an ament_python package."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

NAME = 'servo_rig_driver'
# What it cannot do without; ROS itself comes by package.xml, or as wheels (requirements/).
REQUIRES = [
    'backports.zstd; python_version < "3.14"',
    'canopen',
    'cantools',
    'numba',
    'numpy>=1.26.4',
    'python-can',
    'pyyaml',
    'rosbags',
]


def shared_files(folder):
    """Return the files below folder as setuptools' data_files, keeping their subfolders."""
    by_target = {}
    for path in sorted(Path(folder).rglob('*')):
        if path.is_file():
            below = path.parent.relative_to(Path(folder).parent)
            by_target.setdefault(f'share/{NAME}/{below}', []).append(str(path))
    return sorted(by_target.items())


def configuration():
    """Return the files of config/ that the rig's side reads; servo_twin installs all of them."""
    return [(target, kept) for target, files in shared_files('../../config') if (kept := [
        file for file in files
        if Path(file).parent.name in ('dds', 'rigs', 'drivers', 'imports', 'robots')
        or Path(file).name in ('adapter.yaml', 'diagnostics.yaml', 'driver.yaml',
                               'recorder.yaml')])]


setup(
    name=NAME,
    version=ElementTree.parse('package.xml').findtext('version'),
    description='The rig: its CAN bus, driver, recorder and the emulated servo bench.',
    license='Apache-2.0',
    maintainer='Servo twin maintainers',
    maintainer_email='maintainers@servo-twin.org',
    packages=find_packages(exclude=['tests']),
    package_data={'servo_rig_driver': ['**/*.eds', '**/*.dbc', '**/*.yaml']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        *shared_files('launch'),
        *configuration(),
    ],
    python_requires='>=3.11',
    install_requires=REQUIRES,
    # `colcon test` looks here for pytest, and in setup.cfg for the tests
    extras_require={'test': ['pytest']},
    zip_safe=False,
    entry_points={
        'console_scripts': [
            'adapter = servo_rig_driver.adapter.adapter_node:main',
            'driver = servo_rig_driver.driver.driver_node:main',
            'recorder = servo_rig_driver.record.recorder_node:main',
            'emulated_rig = servo_rig_driver.emulated.rig_process:main',
            'can_hub = servo_rig_driver.can_bus.can_hub:main',
            'player = servo_rig_driver.record.player_node:main',
        ],
        'can.interface': [
            'unix_bus = servo_rig_driver.can_bus.unix_bus:UnixBus',
        ],
    },
)
