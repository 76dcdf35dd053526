"""Records to rows: pure functions, one per table. A number that was never measured is null, never 0."""

import json
from collections import Counter
from collections.abc import Iterable, Sequence

import asset2sim.catalog.rows_engines as rows_engines
from asset2sim.catalog.run import UNRECORDED_SETTINGS, RunRow, without_credentials
from asset2sim.catalog.summarize import kept_columns, summarize, total_seconds
from asset2sim.checks.at_rest import oscillates
from schemas.asset import AssetRecord, AssetSummary, Unchanged
from schemas.extensions import further_columns
from schemas.interaction import Measurement
from schemas.settings import Thresholds
from schemas.table import Row
from schemas.vocabulary import PAPER_FAILURE_MODES, Severity, Stage, Status

GUESSES = frozenset(
    ("closed_end_guessed", "closed_end_unsure", "moves_nothing", "rescaled_unasked", "support_guessed", "up_doubtful")
)
"""Findings that say that something is a guess, or not there, which a look at the object settles."""


def asset_rows(run: RunRow, record: AssetRecord) -> dict[str, list[Row]]:
    """Table name → an asset's rows, for every table but ``runs``."""
    key, limits = asset_key(run, record), run.settings.thresholds
    return {
        "assets": [asset_row(run, record)],
        "links": link_rows(key, record),
        "joints": joint_rows(key, record, limits),
        "model_calls": call_rows(key, record),
        "trace": trace_rows(key, record),
        "findings": finding_rows(key, record),
        "measurements": rows_engines.measurement_rows(key, record, limits),
        "interactions": rows_engines.interaction_rows(key, record, limits),
        "link_overlaps": rows_engines.overlap_rows(key, record),
        "alignment": rows_engines.alignment_rows(key, record),
        "expectations": rows_engines.expectation_rows(key, record),
    }


def run_cost(assets: Iterable[AssetSummary]) -> dict[str, float]:
    """Model calls that were not answered from the cache, their tokens and their cost, by column."""
    every = list(assets)
    return {
        "queries": sum(asset.queries for asset in every),
        "prompt_tokens": sum(asset.prompt_tokens for asset in every),
        "completion_tokens": sum(asset.completion_tokens for asset in every),
        # Call by call, in the dataset's order: sums of sums are rounded otherwise.
        "cost_usd": float(sum(cost for asset in every for cost in asset.call_costs_usd)),
    }


def asset_row(run: RunRow, record: AssetRecord) -> Row:
    """The row of ``assets``."""
    severities = Counter(finding.severity for finding in record.findings)
    sliders = rows_engines.prismatic_joints(record)
    summary = summarize(record, run.settings.thresholds)
    return asset_key(run, record) | {
        "category": record.category,
        "subset": record.ref.subset,
        "prompt": record.ref.prompt,
        "overrides": record.ref.own_numbers,
        "status": record.status.value,
        "failure_mode": record.failure_mode.value,
        "paper_failure_mode": PAPER_FAILURE_MODES.get(record.failure_mode),
        "reason": record.reason,
        **_shape_columns(record),
        **kept_columns(record.overlay),
        **_measured_columns(record.measurement),
        **rows_engines.motion_columns(record.measurement, sliders, run.settings.thresholds),
        **{column: record.further.get(column) for column, *_ in further_columns()},
        **run_cost([summary]),
        "cached_calls": summary.cached_calls,
        "refine_steps": len(record.trace),
        "refine_accepted": sum(step.accepted for step in record.trace),
        "phi_evaluations": sum(step.evaluations for step in record.trace),
        "doubtful": ", ".join(dict.fromkeys(item.code for item in record.findings if item.code in GUESSES)) or None,
        "errors": severities[Severity.ERROR],
        "warnings": severities[Severity.WARNING],
        **{f"seconds_{stage.value}": record.seconds.get(stage.value) for stage in Stage},
        "seconds_total": float(total_seconds(record)),
        **{f"processor_s_{stage.value}": record.processor_s.get(stage.value) for stage in Stage},
        "processor_s_total": sum(record.processor_s.values()) if record.processor_s else None,
        "content_hash": record.content_hash,
        "source_path": record.ref.path,
        "refined_path": f"assets/{record.ref.asset_id}" if record.written else None,
    }


def link_rows(key: Row, record: AssetRecord) -> list[Row]:
    """Rows of ``links``: none where the asset never got an overlay."""
    if record.overlay is None:
        return []
    features = {link.name: link for link in record.features.links} if record.features else {}
    rows = []
    for link in record.overlay.links:
        seen = features.get(link.name)
        row = key | {"link": link.name, "shapes_source": None}
        row |= link.model_dump(exclude={"name", "com", "inertia", "contents"})
        row |= rows_engines.fields_of(seen, "joint_kind") | {
            "contents_kg": sum(item.mass_kg for item in link.contents),
            "n_meshes": len(seen.meshes) if seen else None,
            "n_watertight": sum(mesh.watertight for mesh in seen.meshes) if seen else None,
            "n_faces": sum(mesh.n_faces for mesh in seen.meshes) if seen else None,
        }
        row |= {f"com_{axis}_m": value for axis, value in zip("xyz", link.com, strict=True)}
        axes = ("xx", "xy", "xz", "yy", "yz", "zz")
        row |= {f"i{pair}_kg_m2": value for pair, value in zip(axes, link.inertia, strict=True)}
        rows.append(row)
    return rows


def joint_rows(key: Row, record: AssetRecord, limits: Thresholds) -> list[Row]:
    """Rows of ``joints``: the movable ones, with what each did when measured; none without an overlay."""
    if record.overlay is None:
        return []
    features = {joint.name: joint for joint in record.features.joints} if record.features else {}
    motions = {motion.name: motion for motion in record.measurement.joints} if record.measurement else {}
    settled = record.measurement.settle_motion if record.measurement else {}
    rows, elsewhere = [], {"name", "least_inertia", "effort_range", "mimic", "exact", "bias"}
    for joint in record.overlay.all_joints:
        seen, motion = features.get(joint.name), motions.get(joint.name)
        row = key | {"joint": joint.name} | joint.model_dump(exclude=elsewhere)
        row |= rows_engines.fields_of(seen, "parent", "child", "openness_confidence")
        effort = {"effort_kind": "kind", "effort_least_n": "least_n", "effort_most_n": "most_n"}
        row |= rows_engines.fields_of(joint.effort_range, **effort)
        row |= rows_engines.fields_of(motion, "amplitude", "sign_changes", "final_position")
        row |= {
            "mechanism_effort": max(joint.bias.most, -joint.bias.least) if joint.bias else None,
            "position_unit": joint.unit,
            "settle_motion": settled.get(joint.name),
            "oscillates": oscillates(motion, joint.type == "prismatic", limits) if motion else None,
        }
        rows.append(row)
    return rows


def call_rows(key: Row, record: AssetRecord) -> list[Row]:
    """Rows of ``model_calls``."""
    return [
        key | {"call_index": index, "call_model": call.model} | call.model_dump(exclude={"model"})
        for index, call in enumerate(record.calls)
    ]


def trace_rows(key: Row, record: AssetRecord) -> list[Row]:
    """Rows of ``trace``."""
    return [
        key
        | step.model_dump(exclude={"phi_before_m", "phi_after_m", "moved"})
        | {
            "step_index": index,
            "phi_before_mm": 1000.0 * step.phi_before_m,
            "phi_after_mm": 1000.0 * step.phi_after_m,
            "moved_joints": list(step.moved),
            "moved_positions": list(step.moved.values()),
        }
        for index, step in enumerate(record.trace)
    ]


def finding_rows(key: Row, record: AssetRecord) -> list[Row]:
    """Rows of ``findings``."""
    return [
        key | {"finding_index": index, "limit_value": finding.limit} | finding.model_dump(exclude={"limit"})
        for index, finding in enumerate(record.findings)
    ]


def run_row(run: RunRow, refined: Sequence[AssetSummary], unchanged: Sequence[Unchanged] = ()) -> Row:
    """The row of ``runs``: results count all of the run's assets, costs only those that it refined."""
    every: list[AssetSummary | Unchanged] = [*refined, *unchanged]
    ok = sum(item.status is Status.OK for item in every)
    return {
        **run.model_dump(exclude={"settings", "versions"}),
        "method": run.settings.method.value,
        "model": run.settings.model.model,
        "settings_json": without_credentials(run.settings.model_dump_json(exclude=UNRECORDED_SETTINGS)),
        "versions_json": json.dumps(run.versions, sort_keys=True),
        "assets": len(every),
        "ok": ok,
        "failed": len(every) - ok,
        "unchanged": len(unchanged),
        "failure_modes_json": json.dumps(Counter(item.failure_mode.value for item in every), sort_keys=True),
        **run_cost(refined),
        "seconds": (run.finished_at - run.started_at).total_seconds(),
        "asset_seconds": float(sum(asset.total_seconds for asset in refined)),
    }


def asset_key(run: RunRow, record: AssetRecord) -> Row:
    """The columns that every row of an asset begins with."""
    return {"run_id": run.run_id, "asset_id": record.ref.asset_id, "method": record.method.value, "model": record.model}


def _shape_columns(record: AssetRecord) -> Row:
    """Columns of scale, mass, size and counts; null for stages that the asset did not reach."""
    overlay, features = record.overlay, record.features
    taken, support = rows_engines.fields_of, overlay.support if overlay else None
    size = [edge * overlay.scale for edge in features.rest_size] if overlay and features else [None] * 3
    links = features.links if features else overlay.links if overlay else None
    joints = overlay.all_joints if overlay else features.movable_joints if features else None
    return {
        **taken(overlay, "scale", "scale_source", "scale_sigma", "mass_kg", "contact_friction", "contact_source"),
        **{f"size_{axis}_m": edge for axis, edge in zip("xyz", size, strict=True)},
        **taken(support, support="kind", support_mount="mount"),
        **taken(support, support_source="source", support_confidence="confidence"),
        "n_links": None if links is None else len(links),
        "n_joints": None if joints is None else len(joints),
    }


def _measured_columns(measured: Measurement | None) -> Row:
    """Columns that only ``assets`` holds of the measurement."""
    return rows_engines.fields_of(measured, "engine", "engine_version", "settle_s", "test_s") | {
        "deepest_contact_mm": 1000.0 * max((p.depth_m for p in measured.pairs), default=0.0) if measured else None,
        "penetrating_pairs": len(measured.pairs) if measured else None,
    }
