"""Numbers of the user's own: where they stand, which goes first, and what is said of those that are wrong."""

from pathlib import Path

import pytest

from asset2sim.intake.dataset import load_dataset
from asset2sim.intake.overrides import FILE, read_overrides, with_prompt
from asset2sim.runs.check_request import check_request
from asset2sim.runs.plan.content_hash import content_hash
from schemas.asset import AssetRef, Overrides, StatedPosition
from schemas.errors import UsageError
from schemas.settings import Settings
from schemas.support import SupportKind
from tests.test_intake_dataset import write_manifest, write_urdf

MANIFEST = "asset_id,path,prompt,scale,mass_kg,joint:lid\na,a,A box.,0.5,2,open\nb,b,,,,\n"


def stated(folder: Path, text: str) -> dict[str, AssetRef]:
    (folder / FILE).write_text(text, encoding="utf-8")
    return {ref.asset_id: ref for ref in load_dataset(folder)}


def test_a_manifest_states_numbers_in_columns_of_its_own(tmp_path: Path) -> None:
    a, b = load_dataset(write_manifest(tmp_path, MANIFEST))
    assert a.overrides is not None and b.overrides is None
    assert (a.overrides.scale, a.overrides.mass_kg) == (0.5, 2.0)
    assert a.overrides.joints == {"lid": StatedPosition(value=1.0, unit="share")}
    assert a.overrides.place("scale").endswith("manifest.csv, line 2, column 'scale'")


def test_the_file_beside_it_goes_first(tmp_path: Path) -> None:
    write_manifest(tmp_path, MANIFEST)
    text = "asset_id,size_m,support,prompt,joint:lid,material:link_1\na,0.3,fixed,A chest.,30deg,Steel\n"
    a = stated(tmp_path, text)["a"]
    assert (a.prompt, a.support) == ("A chest.", SupportKind.FIXED)
    assert a.overrides is not None
    assert (a.overrides.scale, a.overrides.size_m, a.overrides.mass_kg) == (None, 0.3, 2.0)
    assert a.overrides.joints == {"lid": StatedPosition(value=30.0, unit="deg")}
    assert a.overrides.materials == {"link_1": "steel"}
    assert "overrides.csv" in a.overrides.place("size_m") and "manifest.csv" in a.overrides.place("mass_kg")


def test_a_folder_without_a_manifest_may_have_the_file_too(tmp_path: Path) -> None:
    write_urdf(tmp_path / "box")
    assert stated(tmp_path, "asset_id,scale\nbox,0.2\n")["box"].overrides == Overrides(
        scale=0.2, where={"scale": f"{(tmp_path / FILE).resolve()}, line 2"}
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("asset_id,scal\na,1\n", "column 'scal' is unknown; is it 'scale'?"),
        ("asset_id,joint:\na,1\n", "column 'joint:' names nothing after its colon"),
        ("id,scale\na,1\n", "column asset_id missing"),
        ("asset_id,scale,scale\na,1,2\n", "column scale more than once"),
        ("asset_id,scale\naa,1\n", "line 2: the dataset has no asset 'aa'; did you mean 'a'"),
        ("asset_id,scale\na,1\nb,1\na,2\n", "line 4: asset 'a' stands in line 2 already"),
        ("asset_id,scale\na,-3\n", "line 2, column 'scale': '-3' cannot be; it must be above 0"),
        ("asset_id,scale\na,0\n", "'0' cannot be"),
        ("asset_id,mass_kg\na,nan\n", "'nan' cannot be"),
        ("asset_id,mass_kg\na,1e999\n", "'1e999' cannot be"),
        ("asset_id,mass_kg\na,3 kg\n", "column 'mass_kg': '3 kg' is not a number"),
        ("asset_id,scale,size_m\na,1,1\n", "columns 'scale' and 'size_m' both say how large"),
        ("asset_id,joint:lid\na,opne\n", "column 'joint:lid': 'opne' is no position"),
        ("asset_id,joint:lid\na,opne\n", "did you mean 'open'"),
        ("asset_id,joint:lid\na,120%\n", "'120%' cannot be; a joint is 0% (closed) to 100% open"),
        ("asset_id,joint:lid\na,inf\n", "'inf' is no position"),
        ("asset_id,joint:lid\na,1e999\n", "'1e999' is no position"),
        ("asset_id,material:body\na,steal\n", "no material is known as 'steal'; did you mean 'steel'"),
        (
            "asset_id,support\na,fixt\n",
            "line 2, column 'support': 'fixt' is none of freestanding, fixed, handheld; did",
        ),
        ("asset_id,scale\na,1,2\n", "line 2: more cells than columns"),
    ],
)
def test_what_is_wrong_is_named_with_its_place_and_the_nearest_name(tmp_path: Path, text: str, said: str) -> None:
    write_manifest(tmp_path, MANIFEST)
    with pytest.raises(UsageError) as error:
        stated(tmp_path, text)
    assert said in str(error.value) and str(tmp_path / FILE) in str(error.value)


def test_the_same_holds_for_the_manifests_columns(tmp_path: Path) -> None:
    write_manifest(tmp_path, "asset_id,path,mass_kg\na,a,-3\n")
    with pytest.raises(UsageError, match=r"manifest\.csv, line 2, column 'mass_kg': '-3' cannot be"):
        load_dataset(tmp_path)


def test_numbers_decide_what_is_unchanged_and_their_line_does_not() -> None:
    def key(cells: dict[str, str], where: str = "line 2") -> str:
        ref = AssetRef(asset_id="a", path="/a", overrides=read_overrides(cells, where))
        return content_hash(ref, "files", "shared")

    cells: tuple[dict[str, str], ...] = (
        *({}, {"scale": "0.5"}, {"scale": "0.6"}, {"size_m": "0.5"}, {"joint:lid": "0.5"}, {"joint:lid": "50%"}),
        *({"joint:box": "0.5"}, {"material:lid": "steel"}, {"material:lid": "glass"}, {"mass_kg": "0.5"}),
    )
    assert len({key(row) for row in cells}) == len(cells)
    assert key({"scale": "0.5"}, "line 9") == key({"scale": "0.5"})


def test_a_prompt_on_the_command_line_is_for_one_asset(tmp_path: Path) -> None:
    refs = [AssetRef(asset_id=name, path=f"/{name}", prompt="A box.") for name in "ab"]
    assert with_prompt(refs, None) == refs
    with pytest.raises(UsageError, match="--prompt is for one asset, and these are 2"):
        with_prompt(refs, "An open box.")
    box = write_urdf(tmp_path / "box")
    settings = Settings(prompt="An open box.")
    assert [ref.prompt for ref in check_request(box, tmp_path / "out", settings, None, (), None).refs] == [
        "An open box."
    ]
