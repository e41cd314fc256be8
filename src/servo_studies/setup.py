"""Installs servo_studies as an ament_python package."""

from xml.etree import ElementTree

from setuptools import find_packages, setup

NAME = 'servo_studies'
# What it cannot do without; ROS itself comes by package.xml, or as wheels (requirements/).
REQUIRES = [
    'matplotlib',
    'numba',
    'numpy>=1.26.4',
    'pyyaml',
    'rich',
    'scikit-learn',
    'scipy',
    'servo_identify',
    'servo_twin',
]
EXTRAS = {
    'linear': ['control'],  # the linear forms of paper 004
}


setup(
    name=NAME,
    version=ElementTree.parse('package.xml').findtext('version'),
    description='The systems of the papers, real machines, and the blind check of the diagnosis.',
    license='Apache-2.0',
    maintainer='Servo twin maintainers',
    maintainer_email='maintainers@servo-twin.org',
    packages=find_packages(exclude=['tests']),
    package_data={'servo_studies': ['**/*.html', '**/*.css', '**/*.js', '**/*.yaml']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
    ],
    python_requires='>=3.11',
    install_requires=REQUIRES,
    # `colcon test` looks here for pytest, and in setup.cfg for the tests
    extras_require=EXTRAS | {'test': ['pytest']},
    zip_safe=False,
    entry_points={
        'servo_identify.commands': [
            'results = servo_studies.commands.results',
            'blind-check = servo_studies.commands.blind_check',
        ],
    },
)
