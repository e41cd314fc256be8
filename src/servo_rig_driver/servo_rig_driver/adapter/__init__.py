"""The adapter: samples from what another driver publishes, such as ros2_control."""
