"""Where the public models lie that ship in Python packages, and which of them are compared."""

import importlib.util
import re
import sysconfig
from pathlib import Path

#: Arms, hands, quadrupeds, bipeds, humanoids; by name the file inside example-robot-data.
URDF = {
    "double_pendulum_simple": "double_pendulum_description/urdf/double_pendulum_simple.urdf",
    "ur5": "ur_description/urdf/ur5_robot.urdf",
    "panda": "panda_description/urdf/panda.urdf",
    "kinova": "kinova_description/robots/kinova.urdf",
    "xarm7": "xarm_description/urdf/xarm7.urdf",
    "z1": "z1_description/urdf/z1.urdf",
    "so101": "so_arm_description/urdf/so101.urdf",
    "allegro_hand": "allegro_hand_description/urdf/allegro_right_hand.urdf",
    "finger_edu": "finger_edu_description/robots/finger_edu.urdf",
    "solo12": "solo_description/robots/solo12.urdf",
    "hyq": "hyq_description/robots/hyq_no_sensors.urdf",
    "a1": "a1_description/urdf/a1.urdf",
    "go2": "go2_description/urdf/go2.urdf",
    "anymal": "anymal_b_simple_description/robots/anymal.urdf",
    "bolt": "bolt_description/robots/bolt.urdf",
    "simple_humanoid": "simple_humanoid_description/urdf/simple_humanoid.urdf",
    "icub": "icub_description/robots/icub.urdf",
    "baxter": "baxter_description/urdf/baxter.urdf",
    "tiago": "tiago_description/robots/tiago.urdf",
    "talos": "talos_data/robots/talos_full_v2.urdf",
    "romeo": "romeo_description/urdf/romeo_small.urdf",
    "centauro": "centauro_description/urdf/centauro.urdf",
    "human": "human_description/robots/human.urdf",
}
#: Of dm_control's suite.
MJCF = (
    *("acrobot", "cartpole", "pendulum", "reacher", "hopper", "walker", "cheetah", "humanoid", "humanoid_CMU"),
    *("swimmer", "finger", "fish", "manipulator", "stacker", "quadruped", "dog"),
)
#: Models with loops: package and file, the values and velocities of some joints, and bodies whose masses are those of
#: meshes that are not in the package.
LOOPS = {
    "panda with Robotiq 2F-85": (
        *("mujoco_playground", "_src/manipulation/franka_emika_panda_robotiq/xmls/panda_updated_robotiq_2f85.xml"),
        {"joint2": 0.3, "joint4": -1.2, "left_driver_joint": 0.4},
        {"joint1": 0.7, "joint4": -0.5, "left_driver_joint": 1.1},
        ("base_mount", "fts300_sensor_body"),
    ),
    "constraints of MJX": ("mujoco.mjx", "test_data/constraints.xml", {"joint4": 0.1}, {"joint4": 0.7}, ()),
}


def robot_descriptions() -> Path | None:
    """The folder of example-robot-data, None where it is not installed."""
    folder = Path(sysconfig.get_path("purelib")) / "cmeel.prefix/share/example-robot-data/robots"
    return folder if folder.exists() else None


def package_folder(name: str) -> Path | None:
    """The folder of a package, found without importing it; None where it is not installed."""
    found = importlib.util.find_spec(name)
    return None if found is None or found.origin is None else Path(found.origin).parent


def looped_text(name: str) -> str | None:
    """The text of one of `LOOPS`, an inertia given to bodies without their meshes; None where it is not installed."""
    package, file, _, _, light = LOOPS[name]
    folder = package_folder(package)
    if folder is None:
        return None
    text = (folder / file).read_text(encoding="utf-8")
    for body in light:
        inertia = '<inertial mass="0.1" pos="0 0 0" diaginertia="1e-4 1e-4 1e-4"/>'
        text, count = re.subn(rf'(<body[^>]*name="{body}"[^>]*>)', rf"\1{inertia}", text)
        assert count == 1
    return text


def public_models() -> dict[str, Path]:
    """Files by name, of the packages that are installed."""
    robots, control = robot_descriptions(), package_folder("dm_control")
    found = {} if robots is None else {name: robots / file for name, file in URDF.items()}
    return found | ({} if control is None else {name: control / "suite" / f"{name}.xml" for name in MJCF})
