"""Installs cfplan_core and cfplan_ros, with pip or as the ament_python package cfplan_ros."""

from pathlib import Path

from setuptools import find_packages, setup

PACKAGE = 'cfplan_ros'


def files_below(top: str) -> list[tuple[str, list[str]]]:
    """List the files below a folder, folder by folder, with where they are installed."""
    folders = sorted({path.parent for path in Path(top).rglob('*') if path.is_file()})
    return [
        (
            f'share/{PACKAGE}/{folder.as_posix()}',
            sorted(path.as_posix() for path in folder.iterdir() if path.is_file()),
        )
        for folder in folders
    ]


setup(
    name=PACKAGE,
    version='0.1.0',
    description=(
        'Plans planar dexterous manipulation as a sequence of contact formations, '
        'with joint trajectories and joint torque limits.'
    ),
    long_description=Path('README.md').read_text(encoding='utf-8'),
    long_description_content_type='text/markdown',
    license='Apache-2.0',
    maintainer='cfplan maintainers',
    maintainer_email='maintainers@cfplan.example',
    packages=find_packages(include=['cfplan_core*', 'cfplan_ros*']),
    package_data={'': ['*.schema.json', 'py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
        *files_below('config'),
        *files_below('launch'),
    ],
    zip_safe=False,
    python_requires='>=3.10',
    install_requires=[
        'click>=8.1',
        'jsonschema>=4.10',
        'matplotlib>=3.6',
        'mcap>=1.5',
        'networkx>=2.8',
        'numpy>=1.26',
        'pillow>=10.0',
        'pyyaml>=6.0',
        'rich>=13.0',
        'scipy>=1.11',
        'shapely>=2.0',
        'toppra>=0.6.10',
    ],
    extras_require={
        'mujoco': ['mujoco>=3.3'],
        'study': ['dask>=2024.8', 'distributed>=2024.8', 'mujoco>=3.3', 'pyarrow>=14.0'],
        'test': [
            'dask>=2024.8',
            'distributed>=2024.8',
            'hypothesis>=6.100',
            'mujoco>=3.3',
            'psutil>=5.9',
            'pyarrow>=14.0',
            'pytest>=7.4',
            'pytest-benchmark>=4.0',
            'pytest-xdist>=3.5',
            'rosbags>=0.10',
        ],
        'lint': ['mypy>=1.11', 'ruff>=0.6', 'scipy-stubs', 'types-jsonschema', 'types-PyYAML'],
    },
    entry_points={
        'console_scripts': [
            'cfplan = cfplan_core.command_line:main',
            'planner_node = cfplan_ros.planner_node:main',
        ],
        'cfplan.commands': [
            'bag = cfplan_ros.command_line.bag:bag',
            'call = cfplan_ros.command_line.call:call',
            'execute = cfplan_ros.command_line.execute:execute',
            'node = cfplan_ros.command_line.node:node',
            'recover = cfplan_ros.command_line.recover:recover',
        ],
    },
)
