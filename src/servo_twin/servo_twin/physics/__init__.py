"""The effects and the step: a servo as equations, free of ROS, files and clocks."""
