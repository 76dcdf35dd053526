"""What mutated URDFs hold in the place of numbers, names, files, scales, types and tags."""

# ruff: noqa: E501

NUMBERS = (
    *("nan", "-nan", "inf", "-inf", "1e30", "-1e30", "1e308", "1e999", "1e-320", "0", "-0", "-0.0", "-1", "1e9", "-1e-9"),
    *("", " ", "abc", "0x10", "1,5", "1.2.3", "--1", "1e", "None", "true", "١٢", "½", "9" * 400, "1 2", "1 2 3 4 5 6 7"),
)  # fmt: skip
NAMES = (
    *("", " ", "nan", "world", "base", ".", "..", "../../x", "/abs", "a b", "a\tb", "a\nb", "a/b", "a\\b", "a;b", "a'b"),
    *('a"b', "<b>", "&amp;", "ü", "名", "🙂", "--", "e\u0301", "\u202eabc", "%s{0}", "x" * 5000, "[31m"),
)  # fmt: skip
FILES = (
    *("", " ", ".", "..", "/", "~", "textured_objs", "mobility.urdf", "semantics.txt", "images/texture_0.png", "gone.obj"),
    *("../outside/secret.obj", "../../outside/secret.obj", "{outside}/secret.obj", "file://{outside}/secret.obj"),
    *("package://../../outside/secret.obj", "package://outside/secret.obj", "model://outside/secret.obj", "/etc/passwd"),
    *("file:///etc/passwd", "http://127.0.0.1:9/a.obj", "https://example.com/a.stl", "package://", "://", "$(find x)/a.obj"),
    *("C:\\meshes\\a.obj", "textured_objs\\original-1.obj", "a" * 300 + ".obj", "x/" * 3000 + "a.obj", "a\nb.obj", "%2e%2e/a"),
    *("/dev/zero", "/dev/stdin", "/proc/self/mem", "a.fbx", "a.zip", "data:,v", "textured_objs/original-1.obj/x"),
)  # fmt: skip
SCALES = (
    *("0 0 0", "1 1 0", "nan nan nan", "nan", "-0 -0 -0", "-0.0 1 1", "0", "1", "-1", "-1 -1 -1", "1 1", "1 1 1 1", "a b c"),
    *("", " ", "1e30 1e30 1e30", "1e-30 1e-30 1e-30", "1e308 1 1", "inf 1 1", "1,1,1", "1;1;1", "-1 1 1", "1e-12 1e12 1"),
)  # fmt: skip
TYPES = (
    "", "fixed", "revolute", "continuous", "prismatic", "planar", "floating", "ball", "REVOLUTE", "revolute ", "nan",
)  # fmt: skip
TAGS = (
    *("link", "joint", "visual", "collision", "geometry", "mesh", "box", "sphere", "cylinder", "capsule", "origin", "axis"),
    *("limit", "inertial", "mass", "inertia", "material", "texture", "color", "mimic", "robot", "parent", "child", "nonsense"),
    *("dynamics", "safety_controller", "calibration", "transmission", "gazebo"),
)  # fmt: skip
OTHERS = (
    *(b"", b" \n", b"\x00" * 1000, b"{}", b"<robot/>", b"<robot>" * 5000, b"<sdf version='1.7'><model/></sdf>", b"<a/>" * 2),
    *(b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n", b"<html><body>404</body></html>", b"<mujoco/>"),
    *(b"<robot xmlns='urn:x'/>", b"<x:robot xmlns:x='urn:x' name='a'/>", b"PK\x03\x04" + b"\x00" * 100),
)  # fmt: skip
