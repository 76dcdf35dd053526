"""The commands that hand refined objects on, and print what was written."""

from pydantic_settings import get_subcommand
from rich.text import Text

from asset2sim.catalog.text import output
from asset2sim.runs.option_groups import ApplyOverlaysOptions, ExportOverlaysOptions, OverlaysOptions, PackOptions
from asset2sim.runs.overlays import apply_overlays, export_overlays
from schemas.errors import DONE, FAILED, complain
from schemas.settings import Settings

REMAKE = "tasks.remake:remake_asset"
"""The function that makes one object again."""


def print_pack(options: PackOptions, _: Settings) -> None:
    """Write a pack, and print where it is and how it is opened."""
    from asset2sim.packs.declared_pack import find_pack
    from asset2sim.packs.write import write_pack

    pack = find_pack(options.for_)
    packed = write_pack(options.run, options.out, pack, options.assets, options.license)
    output().print(Text(f"{len(packed)} objects for {pack.title} in {options.out}\n  cd {options.out}; {pack.opens}"))


def print_overlays(options: OverlaysOptions, settings: Settings) -> int:
    """Export overlays or apply them, and print what was written. Returns the exit code: 1 where not all was."""
    chosen = get_subcommand(options, is_required=True)
    if isinstance(chosen, ExportOverlaysOptions):
        written, left_out = export_overlays(chosen.run, chosen.out, chosen.assets)
        output().print(Text(f"{len(written)} objects without geometry in {chosen.out}"))
        for line in left_out:
            complain(line)
        return FAILED if left_out else DONE
    assert isinstance(chosen, ApplyOverlaysOptions)
    made = apply_overlays(
        chosen.overlays, chosen.data, chosen.out, settings.run, REMAKE, chosen.assets, settings.inputs
    )
    same = [item for item in made if item.outcome == "same"]
    slowest = max((item.seconds for item in made), default=0.0)
    told = f"{len(same)} of {len(made)} objects made again, byte for byte, in {chosen.out / 'assets'}"
    output().print(Text(f"{told} (the slowest took {slowest:.1f} s)"))
    for item in made:
        if item.outcome != "same":
            complain(f"{item.asset_id} ({item.outcome}): {item.reason}")
    return DONE if len(same) == len(made) else FAILED
