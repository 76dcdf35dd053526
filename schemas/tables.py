"""The catalog's tables: an Arrow schema each, with units in column names and a description in every field."""

from schemas.extensions import further_columns
from schemas.table import ASSET_COLUMNS, ASSET_KEY, BY_TYPE, COUNT, FLAG, POSITION, REAL, TEXT, TIME, Column, make_table
from schemas.tables_engines import ALIGNMENTS, EXPECTATIONS, INTERACTIONS, MEASUREMENTS, OVERLAPS, TRACE
from schemas.vocabulary import Stage

_REVIEWS: tuple[Column, ...] = (
    *(
        (name, kind, unit, "Run that had refined the asset as it was reviewed" if name == "run_id!" else text)
        for name, kind, unit, text in ASSET_COLUMNS
    ),
    ("reviewed_at!", TIME, "UTC", "When it was reviewed"),
    ("reviewer!", TEXT, "", "Who reviewed it"),
    ("verdict!", TEXT, "", "good or bad, as a person sees it, whatever the checks say"),
    ("note!", TEXT, "", "What they wrote of it; may be empty"),
)

REVIEWS = make_table(
    "reviews", "one row per review of an asset, method and model", (*ASSET_KEY, "reviewed_at", "reviewer"),
    "What people said of an asset in the viewer; no run removes or rewrites it", _REVIEWS,
)  # fmt: skip
"""Reviews: a folder of files, each written by one viewer."""


OUTCOME_COLUMNS = (
    *("category", "subset", "status", "failure_mode", "paper_failure_mode", "reason", "scale", "mass_kg"),
    *("penetration_mm", "drift_m", "drift_rad", "peak_speed_m_s", "oscillating_joints"),
    *("errors", "warnings", "content_hash"),
)
"""The asset's result and measurements; an unchanged asset keeps its earlier values."""

COST_COLUMNS = ("queries", "cached_calls", "prompt_tokens", "completion_tokens", "cost_usd", "seconds_total")
"""What the run spent on the asset: nothing where it was unchanged."""

_ASSETS: tuple[Column, ...] = (
    *ASSET_COLUMNS,
    ("category!", TEXT, "", "What the object is"),
    ("subset", TEXT, "", "The manifest's subset; null where it names none"),
    ("prompt", TEXT, "", "The user's guidance; null where there is none"),
    ("overrides", TEXT, "", "The user's own numbers as JSON; null where there are none"),
    ("status!", TEXT, "", "ok or failed"),
    ("failure_mode!", TEXT, "", "Why it failed, none for ok; see schemas.vocabulary.FailureMode"),
    ("paper_failure_mode", TEXT, "", "The paper's name for the failure mode; null for ok, and where it has none"),
    ("reason!", TEXT, "", "The verdict in a sentence"),
    ("scale", REAL, "1", "Uniform scale against the authored size"),
    ("scale_source", TEXT, "", "Where the scale came from"),
    ("scale_sigma", REAL, "1", "Relative standard deviation of the size, as proposed; null where none is stated"),
    ("kept", COUNT, "1", "Numbers that are as its file has them; null in runs of older versions"),
    ("supplied", COUNT, "1", "Numbers that its file does not state"),
    ("mended", COUNT, "1", "Numbers of a file in metres that are not believed, or that a check or bound changed"),
    ("authored_json", TEXT, "", "What a file in metres says, how far each number is believed and why; null for others"),
    ("mass_kg", REAL, "kg", "Mass of the whole object"),
    *((f"size_{a}_m", REAL, "m", "Box at the rest pose in the root link's frame, final scale") for a in "xyz"),
    ("support", TEXT, "", "freestanding, fixed (its root is held) or handheld"),
    ("support_mount", TEXT, "", "What a fixed object is fixed to: floor, wall, counter, ceiling, built_in"),
    ("support_source", TEXT, "", "Where that was read"),
    ("support_confidence", REAL, "1", "0 to 1: how sure it is of that"),
    ("doubtful", TEXT, "", "What of it is a guess that a person should look at: codes of findings; null for nothing"),
    ("contact_friction", REAL, "1", "Coulomb coefficient of every contact"),
    ("contact_source", TEXT, "", "Where that came from"),
    ("n_links", COUNT, "1", "Links, the root included"),
    ("n_joints", COUNT, "1", "Movable joints"),
    ("penetration_mm", REAL, "mm", "Φ at the initial position; null where it was never measured"),
    ("deepest_contact_mm", REAL, "mm", "Deepest single contact point at the initial position"),
    ("penetrating_pairs", COUNT, "1", "Pairs of links that overlap at the initial position"),
    ("drift_m", REAL, "m", "Furthest the root moved over the test; null where not measured or not finite"),
    ("drift_rad", REAL, "rad", "Furthest the root turned over the test; null where not measured or not finite"),
    ("peak_speed_m_s", REAL, "m/s", "Fastest link over settling and test; null where not measured or not finite"),
    ("oscillating_joints", COUNT, "1", "Joints that fail the oscillation thresholds; null where not measured"),
    ("finite", FLAG, "", "Whether the simulation stayed finite"),
    *further_columns(),
    ("engine", TEXT, "", "Simulator that measured"),
    ("engine_version", TEXT, "", "Its version"),
    ("timestep_s", REAL, "s", "Its time step"),
    ("settle_s", REAL, "s", "Time given to come to rest before the test"),
    ("test_s", REAL, "s", "Length of the test"),
    ("queries!", COUNT, "1", "Model calls that were not answered from the cache"),
    ("cached_calls!", COUNT, "1", "Model calls that were"),
    ("prompt_tokens!", COUNT, "1", "Tokens sent, cached calls left out"),
    ("completion_tokens!", COUNT, "1", "Tokens received, cached calls left out"),
    ("cost_usd!", REAL, "USD", "What the calls cost, cached calls left out"),
    ("refine_steps!", COUNT, "1", "Refinement steps, accepted or not"),
    ("refine_accepted!", COUNT, "1", "Refinement steps that were accepted"),
    ("phi_evaluations!", COUNT, "1", "Evaluations of Φ over all steps"),
    ("errors!", COUNT, "1", "Findings of severity error"),
    ("warnings!", COUNT, "1", "Findings of severity warning"),
    *(
        (f"seconds_{stage.value}", REAL, "s", f"Wall time of the stage {stage.value}; null if not reached")
        for stage in Stage
    ),
    ("seconds_total!", REAL, "s", "Wall time of the asset"),
    *(
        (f"processor_s_{stage.value}", REAL, "s", f"Processor time of the stage {stage.value}, its engines included")
        for stage in Stage
    ),
    ("processor_s_total", REAL, "s", "Processor time of the asset's process and its engines; null where it died"),
    ("content_hash!", TEXT, "", "Hash of all that the result depends on: files, request, settings, code, engines"),
    ("source_path!", TEXT, "", "Folder that the asset was read from"),
    ("refined_path", TEXT, "", "Folder of the refined asset, relative to OUT; null where nothing was written"),
)

_LINKS: tuple[Column, ...] = (
    *ASSET_COLUMNS,
    ("link!", TEXT, "", "Link name"),
    ("label!", TEXT, "", "What the part is, from the asset's semantics"),
    ("joint_kind", TEXT, "", "Kind of joint that the semantics give the part"),
    ("material", TEXT, "", "Material that the density was taken from"),
    ("density_kg_m3!", REAL, "kg/m³", "Density of the material"),
    ("hollow_factor!", REAL, "1", "Share of the volume that is material"),
    ("volume_m3!", REAL, "m³", "Volume that the mass was computed from"),
    ("volume_source!", TEXT, "", "signed, hull, box, mixed or none"),
    ("outer_m2", REAL, "m²", "Area that the link shows to the outside, a sheet with both sides"),
    ("wall_m", REAL, "m", "Thickness of a shell's wall over that area; 0 for a solid"),
    ("contents_kg", REAL, "kg", "Motors, batteries, counterweights inside; part of the mass"),
    ("mass_rule", TEXT, "", "solid (volume), shell (area and wall), stated, bounded by a rule, or shared"),
    ("mass_kg!", REAL, "kg", "Mass"),
    ("mass_source!", TEXT, "", "Where the mass came from"),
    *((f"com_{a}_m!", REAL, "m", f"Centre of mass, {a}, in the link's frame at the final scale") for a in "xyz"),
    ("com_source!", TEXT, "", "Where the centre of mass came from"),
    *(
        (f"i{ab}_kg_m2!", REAL, "kg·m²", f"Inertia {ab} about the centre of mass, along the link's axes")
        for ab in ("xx", "xy", "xz", "yy", "yz", "zz")
    ),
    ("inertia_source!", TEXT, "", "Where the inertia came from"),
    ("shapes_source", TEXT, "", "Where the collision shapes came from; null without geometry"),
    ("n_meshes", COUNT, "1", "Meshes and primitives of the link"),
    ("n_watertight", COUNT, "1", "How many of them are watertight"),
    ("n_faces", COUNT, "1", "Faces of all of them"),
)

_JOINTS: tuple[Column, ...] = (
    *ASSET_COLUMNS,
    ("joint!", TEXT, "", "Joint name"),
    ("type!", TEXT, "", "revolute, continuous or prismatic"),
    ("position_unit!", TEXT, "", "Unit of this row's positions: rad or m"),
    ("label!", TEXT, "", "What the moved part is"),
    ("parent", TEXT, "", "Parent link"),
    ("child", TEXT, "", "Child link"),
    ("damping!", REAL, f"N·m·s/rad / N·s/m ({BY_TYPE})", "Viscous damping"),
    ("damping_source!", TEXT, "", "Where the damping came from"),
    ("friction!", REAL, f"N·m / N ({BY_TYPE})", "Coulomb friction"),
    ("friction_source!", TEXT, "", "Where the friction came from"),
    ("stiffness!", REAL, f"N·m/rad / N/m ({BY_TYPE})", "Spring stiffness, 0 for a passive joint"),
    ("stiffness_source!", TEXT, "", "Where the stiffness came from"),
    ("spring_reference!", REAL, POSITION, "Position at which the spring is at rest"),
    ("lower", REAL, POSITION, "Lower limit at the final scale; null for continuous joints"),
    ("upper", REAL, POSITION, "Upper limit at the final scale; null for continuous joints"),
    ("limits_source!", TEXT, "", "Where the limits came from"),
    ("closed!", REAL, POSITION, "Position at which the part is closed"),
    ("open!", REAL, POSITION, "Position at which the part is fully open"),
    ("openness_confidence", REAL, "1", "0 to 1: how sure it is which end is closed"),
    ("initial_position!", REAL, POSITION, "Position that the object starts in"),
    ("position_source!", TEXT, "", "Where the initial position came from"),
    ("asked_position", REAL, POSITION, "Position that the proposal asks for; null where it asks for none"),
    ("effective_inertia!", REAL, f"kg·m² / kg ({BY_TYPE})", "What a torque or force on this joint alone accelerates"),
    ("armature", REAL, f"kg·m² / kg ({BY_TYPE})", "Inertia reflected onto the joint, which weighs nothing"),
    ("gravity_load!", REAL, f"N·m / N ({BY_TYPE})", "Gravity's pull on the joint at the initial position"),
    ("holds!", FLAG, "", "Whether it must stay where it is placed"),
    ("mechanism", TEXT, "", "What people would call its mechanism: a friction hinge, a screw; null where not known"),
    ("mechanism_effort", REAL, f"N·m / N ({BY_TYPE})", "The most that it exerts besides a spring; null where nothing"),
    ("effort_kind", TEXT, "", "What a hand takes it for, by which its force is judged; null where not known"),
    ("effort_least_n", REAL, "N", "Least force at its edge that a part of this kind takes; null where not known"),
    ("effort_most_n", REAL, "N", "Largest force at its edge that a part of this kind takes; null where not known"),
    ("amplitude", REAL, POSITION, "max q − min q over the untouched test; null where not measured"),
    ("sign_changes", COUNT, "1", "Sign changes of Δq over the test; null where not measured"),
    ("final_position", REAL, POSITION, "Position at the end of the test; null where not measured"),
    ("settle_motion", REAL, POSITION, "Furthest from the initial position while settling; null where not measured"),
    ("oscillates", FLAG, "", "Whether it fails the oscillation thresholds; null where not measured"),
)

_MODEL_CALLS: tuple[Column, ...] = (
    *ASSET_COLUMNS,
    ("call_index!", COUNT, "1", "0 for the asset's first call"),
    ("purpose!", TEXT, "", "What the call was for"),
    ("call_model!", TEXT, "", "Model that was called"),
    ("attempt!", COUNT, "1", "Attempt at the same request"),
    ("prompt_tokens!", COUNT, "1", "Tokens sent"),
    ("completion_tokens!", COUNT, "1", "Tokens received"),
    ("cost_usd!", REAL, "USD", "Cost"),
    ("latency_s!", REAL, "s", "Time to the answer"),
    ("cached!", FLAG, "", "Whether it was answered from the cache"),
    ("outcome!", TEXT, "", "ok, invalid_answer, provider_error or cached"),
    ("prompt_hash!", TEXT, "", "Hash of the request"),
    ("answer_file", TEXT, "", "File of the answer, in OUT/.cache/answers or a recorded model's folder; null: not kept"),
    ("answered_by", TEXT, "", "Model that once gave a recorded answer; null for any other, and where not known"),
)

_FINDINGS: tuple[Column, ...] = (
    *ASSET_COLUMNS,
    ("finding_index!", COUNT, "1", "0 for the asset's first finding"),
    ("stage!", TEXT, "", "Stage that found it"),
    ("severity!", TEXT, "", "info, warning or error"),
    ("code!", TEXT, "", "Kind of finding"),
    ("link", TEXT, "", "Link concerned"),
    ("joint", TEXT, "", "Joint concerned"),
    ("message!", TEXT, "", "What was found and what to do about it"),
    ("value", REAL, "as the message says", "Number found"),
    ("limit_value", REAL, "as the message says", "Bound that it met"),
)

_RUNS: tuple[Column, ...] = (
    ("run_id!", TEXT, "", "The run"),
    ("started_at!", TIME, "UTC", "Start"),
    ("finished_at!", TIME, "UTC", "End"),
    ("outcome!", TEXT, "", "finished or interrupted"),
    ("dataset!", TEXT, "", "Dataset that was read"),
    ("subset", TEXT, "", "Subset that was asked for"),
    ("selection", TEXT, "", "What --assets and --limit left of it; null for all, and in runs of older versions"),
    ("method!", TEXT, "", "Method"),
    ("model!", TEXT, "", "Model"),
    ("settings_json!", TEXT, "", "Every setting, as JSON"),
    ("git_commit", TEXT, "", "Commit of the checkout; null outside one"),
    ("git_dirty", FLAG, "", "Whether the checkout had changes"),
    ("versions_json!", TEXT, "", "Versions of Python and the packages that matter, as JSON"),
    ("assets!", COUNT, "1", "Assets of the run, unchanged ones included"),
    ("ok!", COUNT, "1", "Those that passed"),
    ("failed!", COUNT, "1", "Those that did not"),
    ("unchanged", COUNT, "1", "Those that were left as an earlier run had made them; null in runs of older versions"),
    ("failure_modes_json!", TEXT, "", "Failure mode → assets, as JSON"),
    ("queries!", COUNT, "1", "Model calls that were not answered from the cache"),
    ("prompt_tokens!", COUNT, "1", "Tokens sent"),
    ("completion_tokens!", COUNT, "1", "Tokens received"),
    ("cost_usd!", REAL, "USD", "What the calls cost"),
    ("seconds!", REAL, "s", "Wall time of the run"),
    ("asset_seconds!", REAL, "s", "Wall time of all its assets, added up"),
)

_HISTORY: tuple[Column, ...] = (
    *ASSET_COLUMNS,
    ("started_at!", TIME, "UTC", "Start of the run"),
    ("unchanged!", FLAG, "", "Whether the run left the asset as an earlier one had made it, at no cost"),
    *(column for column in _ASSETS if column[0].removesuffix("!") in (*OUTCOME_COLUMNS, *COST_COLUMNS)),
)

TABLES = {
    table.name: table
    for table in (
        make_table("assets", "one row per asset, method and model: the latest", ASSET_KEY,
               "How each asset was refined, how it measures and what it cost", _ASSETS),
        make_table("links", "one row per link of an asset, method and model", (*ASSET_KEY, "link"),
               "Mass, centre of mass and inertia as written, and where each number came from", _LINKS),
        make_table("joints", "one row per movable joint of an asset, method and model", (*ASSET_KEY, "joint"),
               "Dynamics, limits and initial position as written, and what the joint did when measured", _JOINTS),
        make_table("model_calls", "one row per model call of an asset, method and model", (*ASSET_KEY, "call_index"),
               "Every call to a model: what for, what it cost and how it ended", _MODEL_CALLS),
        make_table("trace", "one row per refinement step of an asset, method and model", (*ASSET_KEY, "step_index"),
               "Every proposal of joint positions and what the simulator said of it", TRACE),
        make_table("findings", "one row per finding of an asset, method and model", (*ASSET_KEY, "finding_index"),
               "Everything that a stage noticed, changed or refused", _FINDINGS),
        make_table("measurements", "one row per asset, method, model and engine", (*ASSET_KEY, "engine"),
               "What each engine measured of the paper's tests, and whether it passed", MEASUREMENTS),
        make_table("interactions", "one row per test and subject of an asset, method, model and engine",
               (*ASSET_KEY, "engine", "test", "subject"),
               "Every interaction test: dropped, nudged, swept, held, released, opened, reset", INTERACTIONS),
        make_table("link_overlaps", "one row per overlapping pair of links of an asset, method and model",
               (*ASSET_KEY, "link_a", "link_b"),
               "All pairs that overlap in the initial state, parent and child included, and why", OVERLAPS),
        make_table("alignment", "one row per asset, method and model that came to an overlay", ASSET_KEY,
               "How well each asset is what its user asked for, and how far from an expert's choice", ALIGNMENTS),
        make_table("expectations", "one row per asset, method, model and thing that is expected", (*ASSET_KEY, "what"),
               "How each asset meets what readers of its prompt and pictures wrote down beforehand", EXPECTATIONS),
        make_table("runs", "one row per run", ("run_id",),
               "What was run, with which settings and versions, and how it ended", _RUNS),
    )
}  # fmt: skip
"""Tables of the catalog's folder by name: written together, with the latest rows of every asset."""

HISTORY = make_table(
    "asset_history", "one row per run and asset, method and model", ("run_id", *ASSET_KEY),
    "How each asset ended in every run, how it measured and what it cost", _HISTORY,
)  # fmt: skip
"""History of all runs: an append-only folder of files by month of the run's start."""

PUBLISHED = {**TABLES, HISTORY.name: HISTORY, REVIEWS.name: REVIEWS}
"""Every table that can be read, by name."""
