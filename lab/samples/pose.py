"""Moves a blueprint's parts from their closed pose to the authored pose, which the files have."""

import math
from dataclasses import replace

import numpy as np

from asset2sim.physics.arrays import Array
from lab.samples.blueprint import Blueprint, JointSpec, Link
from lab.samples.shapes import Mesh, Point

DIGITS = 6


def authored_parts(blueprint: Blueprint) -> tuple[Link, ...]:
    """The parts moved to their joints' ``authored`` positions, limits counted from there; centred as real data is."""
    by_key = {part.key: part for part in blueprint.parts}
    moved = tuple(_moved(part, by_key) for part in blueprint.parts)
    vertices = np.vstack([piece.mesh.vertices for part in moved for piece in part.pieces])
    centre = np.round((vertices.min(axis=0) + vertices.max(axis=0)) / 2.0, 3)
    return tuple(_shifted(part, -centre) for part in moved)


def _frame(part: Link, by_key: dict[str, Link]) -> Array:
    """(4, 4) transform of a part from the closed to the authored pose."""
    return np.eye(4) if part.joint is None else _frame(by_key[part.joint.parent], by_key) @ _motion(part.joint)


def _motion(joint: JointSpec) -> Array:
    # Rodrigues about the joint's axis, which the blueprints give with unit length.
    motion = np.eye(4)
    axis = np.array(joint.axis)
    if joint.type == "prismatic":
        motion[:3, 3] = axis * joint.authored
        return motion
    x, y, z = joint.axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn = np.eye(3) + math.sin(joint.authored) * cross + (1.0 - math.cos(joint.authored)) * (cross @ cross)
    motion[:3, :3] = turn
    motion[:3, 3] = np.array(joint.point) - turn @ np.array(joint.point)
    return motion


def _moved(part: Link, by_key: dict[str, Link]) -> Link:
    frame, joint = _frame(part, by_key), part.joint
    pieces = tuple(replace(piece, mesh=_transformed(piece.mesh, frame)) for piece in part.pieces)
    if joint is not None:
        before = _frame(by_key[joint.parent], by_key)
        point = before[:3, :3] @ np.array(joint.point) + before[:3, 3]
        axis = before[:3, :3] @ np.array(joint.axis)
        lower, upper = joint.lower - joint.authored, joint.upper - joint.authored
        joint = replace(joint, point=_point(point), axis=_point(axis), lower=lower, upper=upper)
    return replace(part, pieces=pieces, joint=joint)


def _shifted(part: Link, shift: Array) -> Link:
    pieces = []
    for piece in part.pieces:
        # Rounded here, so that boxes and files agree on the last digit.
        vertices = np.round(piece.mesh.vertices + shift, DIGITS) + 0.0
        pieces.append(replace(piece, mesh=replace(piece.mesh, vertices=vertices)))
    joint = part.joint
    if joint is not None and joint.type != "prismatic":
        joint = replace(joint, point=_point(np.array(joint.point) + shift))
    return replace(part, pieces=tuple(pieces), joint=joint)


def _transformed(mesh: Mesh, motion: Array) -> Mesh:
    return replace(mesh, vertices=mesh.vertices @ motion[:3, :3].T + motion[:3, 3])


def _point(values: Array) -> Point:
    x, y, z = (round(float(value), DIGITS) + 0.0 for value in values)
    return (x, y, z)
