"""Message and service texts of the PR2 that ROS's own packages lack: facts of its interface.

Field names, types and order fix the md5 by which two nodes agree; a test holds these against the
sums of the real packages. Sources: pr2_common, pr2_mechanism_msgs, pr2_controllers, pr2_robot.
"""

from typing import Final, NamedTuple

MESSAGES: Final[dict[str, str]] = {
    "robot_mechanism_controllers/JTCartesianControllerState": """
Header header
geometry_msgs/PoseStamped x
geometry_msgs/PoseStamped x_desi
geometry_msgs/PoseStamped x_desi_filtered
geometry_msgs/Twist x_err
geometry_msgs/Twist xd
geometry_msgs/Twist xd_desi
geometry_msgs/Wrench F
float64[] tau_pose
float64[] tau_posture
float64[] tau
std_msgs/Float64MultiArray J
std_msgs/Float64MultiArray N
""",
    "pr2_msgs/PowerBoardState": """
int8 STATE_NOPOWER=0
int8 STATE_STANDBY=1
int8 STATE_PUMPING=2
int8 STATE_ON=3
int8 STATE_ENABLED=3
int8 STATE_DISABLED=4
int8 MASTER_NOPOWER=0
int8 MASTER_STANDBY=1
int8 MASTER_ON=2
int8 MASTER_OFF=3
int8 MASTER_SHUTDOWN=4
Header header
string name
uint32 serial_num
float64 input_voltage
int8 master_state
int8[3] circuit_state
float64[3] circuit_voltage
bool run_stop
bool wireless_stop
""",
    "pr2_mechanism_msgs/ActuatorStatistics": """
string name
int32 device_id
time timestamp
int32 encoder_count
float64 encoder_offset
float64 position
float64 encoder_velocity
float64 velocity
bool calibration_reading
bool calibration_rising_edge_valid
bool calibration_falling_edge_valid
float64 last_calibration_rising_edge
float64 last_calibration_falling_edge
bool is_enabled
bool halted
float64 last_commanded_current
float64 last_commanded_effort
float64 last_executed_current
float64 last_executed_effort
float64 last_measured_current
float64 last_measured_effort
float64 motor_voltage
int32 num_encoder_errors
""",
    "pr2_mechanism_msgs/JointStatistics": """
string name
time timestamp
float64 position
float64 velocity
float64 measured_effort
float64 commanded_effort
bool is_calibrated
bool violated_limits
float64 odometer
float64 min_position
float64 max_position
float64 max_abs_velocity
float64 max_abs_effort
""",
    "pr2_mechanism_msgs/ControllerStatistics": """
string name
time timestamp
bool running
duration max_time
duration mean_time
duration variance_time
int32 num_control_loop_overruns
time time_last_control_loop_overrun
""",
    "pr2_mechanism_msgs/MechanismStatistics": """
Header header
ActuatorStatistics[] actuator_statistics
JointStatistics[] joint_statistics
ControllerStatistics[] controller_statistics
""",
}


class ServiceText(NamedTuple):
    """The two halves of a service."""

    request: str
    response: str


SERVICES: Final[dict[str, ServiceText]] = {
    "std_srvs/Empty": ServiceText("", ""),
    "std_srvs/Trigger": ServiceText("", "bool success\nstring message"),
    "std_srvs/SetBool": ServiceText("bool data", "bool success\nstring message"),
    "pr2_mechanism_msgs/ListControllers": ServiceText(
        "", "string[] controllers\nstring[] state"
    ),
    "pr2_mechanism_msgs/LoadController": ServiceText("string name", "bool ok"),
    "pr2_mechanism_msgs/UnloadController": ServiceText("string name", "bool ok"),
    "pr2_mechanism_msgs/SwitchController": ServiceText(
        "string[] start_controllers\nstring[] stop_controllers\nint32 strictness\n"
        "int32 BEST_EFFORT=1\nint32 STRICT=2",
        "bool ok",
    ),
    "pr2_power_board/PowerBoardCommand": ServiceText(
        "uint32 serial_number\nint32 breaker_number\nstring command\nuint32 flags",
        "int32 retval",
    ),
}  # fmt: skip
