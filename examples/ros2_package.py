"""A pack for ROS 2 (``asset2sim pack OUT --for ros2 --out PACK``) without ROS: its ``package.xml`` by catkin_pkg, which
colcon asks too, and each object's URDF with the package's URIs by yourdfpy.

    python examples/ros2_package.py PACK
"""

import sys
from pathlib import Path

import yourdfpy
from catkin_pkg.package import parse_package

pack = Path(sys.argv[1])
warnings: list[str] = []
package = parse_package(str(pack), warnings=warnings)
package.validate(warnings=warnings)
print(f"{package.name}: format {package.package_format}, built by {package.get_build_type()}, warnings: {warnings}")
for file in sorted(pack.glob("objects/*/ros.urdf")):
    found = lambda fname: str(pack / fname.removeprefix(f"package://{package.name}/"))  # noqa: E731
    robot = yourdfpy.URDF.load(str(file), filename_handler=found)
    print(f"{file.parent.name}: {len(robot.actuated_joints)} joints on {robot.base_link}")
