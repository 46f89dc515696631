"""Starts the planner, by default with the parameters in config/planner_node.yaml.

ros2 launch cfplan_ros planner.launch.py hand_file:=hand.yaml controller:=hand_controller
"""

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription

FILES = ('hand_file', 'object_file')


def _planner(context):
    """Make the node; arguments that are left empty change nothing."""

    def value(name):
        return LaunchConfiguration(name).perform(context)

    remappings = []
    if value('controller'):
        remappings = [('~/joint_trajectory', f'/{value("controller")}/joint_trajectory')]
    return [
        Node(
            package='cfplan_ros',
            executable='planner_node',
            name='cfplan_planner',
            namespace=value('namespace'),
            output='screen',
            parameters=[
                value('params_file'),
                *({name: value(name)} for name in FILES if value(name)),
            ],
            remappings=remappings,
            arguments=['--ros-args', '--log-level', value('log_level')],
        )
    ]


def generate_launch_description():
    """Describe the arguments and the node."""
    share = FindPackageShare('cfplan_ros')
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'params_file',
                default_value=PathJoinSubstitution([share, 'config', 'planner_node.yaml']),
                description='Parameters of the node.',
            ),
            DeclareLaunchArgument(
                'hand_file',
                default_value='',
                description='The hand, instead of that in params_file.',
            ),
            DeclareLaunchArgument(
                'object_file',
                default_value='',
                description='The object, instead of that in params_file.',
            ),
            DeclareLaunchArgument(
                'controller',
                default_value='',
                description='joint_trajectory_controller that executes each plan; empty: none.',
            ),
            DeclareLaunchArgument(
                'namespace', default_value='', description='Namespace of the node.'
            ),
            DeclareLaunchArgument('log_level', default_value='info', description='Log level.'),
            OpaqueFunction(function=_planner),
        ]
    )
