"""Writes and checks ROS bags with rosbag's own library; run by the system's Python (packages python3-rosbag,
python3-sensor-msgs, python3-nav-msgs). Exit code 77: they are not installed.

    rosbag_tool.py write BAG COMPRESSION   a bag with one of every message that housemartin reads
    rosbag_tool.py check BAG               every message, and that types, definitions and digests fit together
"""
import sys

try:
    import genpy
    import genpy.dynamic
    import rosbag
    from geometry_msgs.msg import PoseStamped, TransformStamped
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import Imu, LaserScan, Range
except ImportError as error:
    print(f"no rosbag here: {error}")
    sys.exit(77)

START_S = 1282836370


def stamped(message, seconds):
    message.header.stamp = genpy.Time.from_sec(START_S + seconds)
    message.header.frame_id = "somewhere"
    return message


def scan(i):
    message = stamped(LaserScan(), 0.1 * i)
    message.angle_min, message.angle_max, message.angle_increment = -1.5, 1.5, 0.0125
    message.time_increment, message.scan_time = 1e-4, 0.1
    message.range_min, message.range_max = 0.02, 5.6
    # 3 x nothing, 2 x invalid, one of them too near; the rest from 1 m on in steps of 1/64 m
    odd = [0.0, float("inf"), 5.6, float("nan"), 0.007]
    message.ranges = odd + [1 + k / 64 + i / 1024 for k in range(241 - len(odd))]
    message.intensities = [100.0] * len(message.ranges)
    return message


def imu(i):
    message = stamped(Imu(), 0.01 * i)
    message.orientation.w = 1.0
    message.linear_acceleration.z = 9.75
    message.angular_velocity.x = 0.01
    return message


def odometry(i):
    message = stamped(Odometry(), 0.05 * i)
    message.child_frame_id = "base"
    message.pose.pose.position.x = 0.1 * i
    message.pose.pose.orientation.w = 1.0
    return message


def pose(i):
    message = stamped(PoseStamped(), 0.05 * i)
    message.pose.position.y = 0.2 * i
    message.pose.orientation.w = 1.0
    return message


def sonar(i):
    message = stamped(Range(), 0.05 * i)
    message.min_range, message.max_range, message.range = 0.2, 4.0, 1.5
    return message


def transforms_type(name):
    """The type of transforms: its package is not installed; its definition gives class and digest."""
    bar = "\n" + "=" * 80 + "\n"
    text = "geometry_msgs/TransformStamped[] transforms\n" + bar + "MSG: geometry_msgs/TransformStamped\n" + \
        TransformStamped._full_text
    return genpy.dynamic.generate_dynamic(name, text)[name]


def mount(parent, child):
    message = stamped(TransformStamped(), 0)
    message.header.frame_id, message.child_frame_id = parent, child
    message.transform.translation.x, message.transform.rotation.x = 0.25, 1.0  # upside down
    return message


def write(path, compression):
    with rosbag.Bag(path, "w", compression=compression, chunk_threshold=50000) as bag:
        for count, topic, make in ((100, "/scan", scan), (1000, "/imu/data", imu), (200, "/odom", odometry),
                                   (200, "/vicon/pose", pose), (200, "/height", sonar)):
            for i in range(count):
                message = make(i)
                bag.write(topic, message, message.header.stamp + genpy.Duration(0, 5000000))
        bag.write("/transform", TransformStamped(), genpy.Time(START_S))
        for topic, type_name, transform in (("/tf", "tf/tfMessage", mount("/base", "tower")),
                                            ("/tf_static", "tf2_msgs/TFMessage", mount("tower", "somewhere"))):
            message = transforms_type(type_name)()
            message.transforms = [transform]
            bag.write(topic, message, genpy.Time(START_S))


def check(path):
    types = {m._type: m for m in (PoseStamped, Odometry, Imu, LaserScan, Range)}
    with rosbag.Bag(path) as bag:
        for connection in bag._get_connections():
            installed = types.get(connection.datatype) or transforms_type(connection.datatype)
            from_text = genpy.dynamic.generate_dynamic(connection.datatype, connection.msg_def)[connection.datatype]
            right = connection.md5sum == installed._md5sum == from_text._md5sum
            fields = installed.__slots__ == from_text.__slots__ and installed._slot_types == from_text._slot_types
            print(connection.topic, connection.datatype, "right" if right and fields else "WRONG")
        for topic, message, received in bag.read_messages():
            if message._type in types:
                print(topic, message.header.seq, message.header.stamp, received, message.header.frame_id)
            for each in getattr(message, "transforms", []):
                at = each.transform.translation
                print(topic, each.header.frame_id, each.child_frame_id, at.x, at.y, at.z)


if __name__ == "__main__":
    {"write": write, "check": check}[sys.argv[1]](*sys.argv[2:])
