# SPDX-License-Identifier: BSD-3-Clause
"""Starts Plumbline beside a camera's driver and robot_state_publisher.

    ros2 launch ./plumbline.launch.py output:=office                     # maps until Ctrl-C
    ros2 launch ./plumbline.launch.py output:=today map:=office          # is located in a finished map
"""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import EnvironmentVariable, LaunchConfiguration, PythonExpression

DOMAIN = ["ros2://", EnvironmentVariable("ROS_DOMAIN_ID", default_value="0")]
OUTPUT = ["-o", LaunchConfiguration("output"), "--publish", DOMAIN,
          "--frames", ["base=", LaunchConfiguration("base"), ",odom=", LaunchConfiguration("odom")], "--odom-tf", "auto"]
LOCATED = PythonExpression(["'", LaunchConfiguration("map"), "' != ''"])


def generate_launch_description():
    # SIGINT ends a run with a complete result: launch waits for that before it kills.
    patience = {"output": "screen", "sigterm_timeout": "300", "sigkill_timeout": "10"}
    return LaunchDescription([
        DeclareLaunchArgument("output", description="Folder for the result"),
        DeclareLaunchArgument("map", default_value="", description="Finished map to be located in; empty: a map is made"),
        DeclareLaunchArgument("base", default_value="base_link", description="Frame of the robot's base"),
        DeclareLaunchArgument("odom", default_value="odom", description="Frame of the odometry"),
        ExecuteProcess(cmd=["plumbline", "map", DOMAIN, *OUTPUT], condition=UnlessCondition(LOCATED), **patience),
        ExecuteProcess(cmd=["plumbline", "localize", LaunchConfiguration("map"), DOMAIN, *OUTPUT],
                       condition=IfCondition(LOCATED), **patience),
    ])
