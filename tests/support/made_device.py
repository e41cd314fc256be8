"""A device as the driver makes it, for the tests of its frames."""

from servo_rig_driver.devices.drive_settings import DriveSettings
from servo_rig_driver.driver.rig_health import RigHealth
from servo_rig_driver.driver.rig_watch import RigWatch


def made(kind, table, node=1, host=0, **changed):
    """Return a device with a gear of 10:1 and a motor of 0.1 N m/A: 1 N m/A at the load."""
    values = {'ratio': 10.0, 'torque_constant': 0.1, 'rest_speed': 0.1, 'kp': 60.0, 'kd': 3.0,
              'brake': 1.0} | changed
    watch = RigWatch({node: 'drive'}, RigHealth(), 1.0)
    return kind(table, DriveSettings(node, host, **values), watch)
