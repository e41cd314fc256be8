"""Installs servo_twin as an ament_python package."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

NAME = 'servo_twin'
# What it cannot do without; ROS itself comes by package.xml, or as wheels (requirements/).
REQUIRES = [
    'backports.zstd; python_version < "3.14"',
    'jinja2',
    'lz4',
    'markupsafe',
    'numba',
    'numpy>=1.26.4',
    'pyyaml',
    'rich',
    'rosbags',
    'scipy',
]
EXTRAS = {
    'fmu': ['fmpy'],  # mechanisms that are FMUs
    'linear': ['control', 'matplotlib'],  # servo-twin linearise
    'simulators': ['mujoco>=3.2'],  # from-mjcf, from-urdf, export
    'view': ['tornado'],  # the live view
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
    description='The servo twin: physics of effects, lockstep model, twin node and bags.',
    license='Apache-2.0',
    maintainer='Servo twin maintainers',
    maintainer_email='maintainers@servo-twin.org',
    packages=find_packages(exclude=['tests']),
    package_data={'servo_twin': ['**/*.html', '**/*.css', '**/*.js', '**/*.yaml', '**/*.c',
                                 'pages/uplot/*']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        *shared_files('launch'),
        *shared_files('../../config'),
        *shared_files('../servo_twin_msgs/msg'),  # for bags, where ROS is not installed
    ],
    python_requires='>=3.11',
    install_requires=REQUIRES,
    # `colcon test` looks here for pytest, and in setup.cfg for the tests
    extras_require=EXTRAS | {'test': ['pytest']},
    zip_safe=False,
    entry_points={
        'console_scripts': [
            'servo-twin = servo_twin.cli:main',
            'twin_node = servo_twin.nodes.twin_node:main',
        ],
    },
)
