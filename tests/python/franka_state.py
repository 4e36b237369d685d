"""The state of an arm as franka_ros2 publishes it, by the definition of franka_msgs 1.0: its types for rosbags and for CycloneDDS."""

from cyclonedds.idl.types import array, float64, int32, sequence, uint8, uint32
from rosbags.typesys import get_types_from_msg
from ros_cyclone import message

TYPE = "franka_msgs/msg/FrankaRobotState"

_PARTS = {
    "CollisionIndicators": "\n".join(f"geometry_msgs/Vector3 {name}" for name in "abcd") + "\nfloat64[7] e\nfloat64[7] f",
    "Elbow": "\n".join(f"float64[2] {name}" for name in ["position", "desired", "commanded", "velocity", "acceleration"]),
    "Errors": "\n".join(f"bool error_{at}" for at in range(37)),
    "FrankaRobotState": """std_msgs/Header header
franka_msgs/CollisionIndicators collision_indicators
sensor_msgs/JointState measured_joint_state
sensor_msgs/JointState desired_joint_state
sensor_msgs/JointState measured_joint_motor_state
float64[7] ddq_d
float64[7] dtau_j
sensor_msgs/JointState tau_ext_hat_filtered
franka_msgs/Elbow elbow
geometry_msgs/WrenchStamped k_f_ext_hat_k
geometry_msgs/WrenchStamped o_f_ext_hat_k
geometry_msgs/InertiaStamped inertia_ee
geometry_msgs/InertiaStamped inertia_load
geometry_msgs/InertiaStamped inertia_total
geometry_msgs/PoseStamped o_t_ee
geometry_msgs/PoseStamped o_t_ee_d
geometry_msgs/PoseStamped o_t_ee_c
geometry_msgs/PoseStamped f_t_ee
geometry_msgs/PoseStamped ee_t_k
geometry_msgs/TwistStamped o_dp_ee_d
geometry_msgs/TwistStamped o_dp_ee_c
geometry_msgs/AccelStamped o_ddp_ee_c
float64 time
float64 control_command_success_rate
uint8 robot_mode
franka_msgs/Errors current_errors
franka_msgs/Errors last_motion_errors
""",
}


def register(store):
    """Makes the types known to a type store of rosbags."""
    for name, text in _PARTS.items():
        store.register(get_types_from_msg(text, f"franka_msgs/msg/{name}"))


def drawn(store, random, make=None, name=TYPE):
    """A state, its numbers drawn at random; `make` makes a message of a type's name and fields, else the store does."""
    make = make or (lambda name, fields: store.types[name](**fields))
    made = {}
    for field, (node, what) in store.get_msgdef(name).fields:
        if node.name == "NAME":
            made[field] = drawn(store, random, make, what)
        elif node.name == "ARRAY":
            made[field] = random.normal(size=what[1])
        elif node.name == "SEQUENCE":
            count = int(random.integers(0, 8))
            made[field] = [f"joint{at}" * at for at in range(count)] if what[0][1][0] == "string" else random.normal(size=count)
        elif what[0] in ("float64", "string", "bool"):
            made[field] = {"float64": float(random.normal()), "string": "x" * int(random.integers(0, 9)), "bool": False}[what[0]]
        else:
            made[field] = int(random.integers(0, 9))
    return make(name, made)


def cyclone_types(store, known, name=TYPE):
    """Adds the type of CycloneDDS for `name`, and those in it, to `known`, which has types by their names."""
    plain = {"float64": float64, "string": str, "bool": bool, "int32": int32, "uint8": uint8, "uint32": uint32}
    annotations = {}
    for field, (node, what) in store.get_msgdef(name).fields:
        if node.name == "NAME":
            annotations[field] = known[what] if what in known else cyclone_types(store, known, what)
        elif node.name == "ARRAY":
            annotations[field] = array[plain[what[0][1][0]], what[1]]
        elif node.name == "SEQUENCE":
            annotations[field] = sequence[plain[what[0][1][0]]]
        else:
            annotations[field] = plain[what[0]]
    known[name] = message(name)(type(name.rsplit("/", 1)[1], (), {"__annotations__": annotations}))
    return known[name]
