"""Manifests as spreadsheets, editors and scripts leave them."""

from collections.abc import Sequence

from schemas.vocabulary import FailureMode
from tests.hostile.case import READ, UNREADABLE, Case
from tests.hostile.tiny import Write, asset, write_files

HEAD = "asset_id,path,category,prompt\n"
LONG = "x" * 20_000


def cases() -> Sequence[Case]:
    """Whole manifests that are wrong, and rows of one that is not."""
    refused = [Case(name, _manifest(content), says=says) for name, (content, says) in _wrong().items()]
    rows = [
        Case(name, asset(), modes, asset_id=row.split(",")[0].strip(' "'), row=row)
        for name, (row, modes) in _rows().items()
    ]
    return [*refused, *rows]


def _wrong() -> dict[str, tuple[str | bytes, str]]:
    """Content → what the line must say."""
    return {
        "empty": ("", "column asset_id, path missing"),
        "mark_alone": (b"\xef\xbb\xbf", "missing"),
        "blank": ("\n\n\n", "missing"),
        "heading_alone": (HEAD, "no rows"),
        "no_heading": ("a,a\nb,b\n", "missing"),
        "column_misspelt": ("asset_id,path,promt\na,a,x\n", "is it 'prompt'?"),
        "column_capitals": ("Asset_ID,Path\na,a\n", "is it 'asset_id'?"),
        "column_blank_inside": ("asset id,path\na,a\n", "is it 'asset_id'?"),
        "column_plural": ("asset_id,path,prompts\na,a,x\n", "is it 'prompt'?"),
        "column_twice": ("asset_id,path,path\na,a,b\n", "more than once"),
        "column_missing": ("asset_id,category\na,Box\n", "column path missing"),
        "column_long": (f"asset_id,{LONG}\na,b\n", "column path missing"),
        "column_control": ('asset_id,"pa\nth"\na,b\n', "unknown"),
        "columns_many": (",".join(f"c{n}" for n in range(5000)) + "\n", "missing"),
        "semicolons": ("asset_id;path\na;a\n", "not by semicolons"),
        "tabs": ("asset_id\tpath\na\ta\n", "not by tabs"),
        "bars": ("asset_id|path\na|a\n", "not by bars"),
        "json": ('[{"asset_id": "a"}]', "missing"),
        "page": ("<html>404</html>", "missing"),
        "pointer": ("version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "missing"),
        "workbook": (b"PK\x03\x04\x14\0\x06\0", "NUL"),
        "utf16": (f"{HEAD}a,a,,\n".encode("utf-16"), "UTF-16"),
        "utf16_no_mark": (f"{HEAD}a,a,,\n".encode("utf-16-le"), "line 1: it holds a NUL byte"),
        "utf32": (f"{HEAD}a,a,,\n".encode("utf-32"), "UTF-"),
        "latin1": (f"{HEAD}a,a,,kö\n".encode("latin-1"), "line 2: byte 0xf6"),
        "windows": (f"{HEAD}a,a,,“x”\n".encode("cp1252"), "line 2: byte 0x93"),
        "nul": (f"{HEAD}a,a,,x\nb,b\0,,\n", "line 3: it holds a NUL byte"),
        "noise": (bytes(range(1, 256)) * 8, "manifest.csv"),
        "quote_open": (f'{HEAD}a,a,,"x\nb,b,,y\nc,c,,z\n', "line 2: a quote opens here"),
        "quote_open_last": (f'{HEAD}a,a,,x\nb,b,,"y', "line 3: a quote opens here"),
        "quote_pair": (f'{HEAD}a,a,,"x\nb,b,,"\nc,c,,z\n', "line 2: its cell 'prompt'"),
        "quote_path": (f'{HEAD}a,"a\nb,b",,\n', "line 2: its cell 'path'"),
        "quote_id": (f'{HEAD}"a,a,,\nb",b,,\n', "line 2: its cell 'asset_id'"),
        "quote_after": (f'{HEAD}a,a,,"x"y\n', "line 2: a quote ends in the middle"),
        "quote_heading": (f'asset_id,path,"prompt\n{LONG}', "line 1: "),
        "swallowed_short": ('asset_id,path,prompt\na,a,"x\nb,b\nc,c,"\n', "line 2: its cell 'prompt'"),
        "cell_long": (f"{HEAD}a,a,,x\nb,b,,{LONG}\n", "line 3: column 'prompt' has 20,000 characters"),
        "cell_very_long": (f"{HEAD}a,a,,{'x' * 200_000}\n", "line 2: a cell has over"),
        "cells_more": (f"{HEAD}a,a,,x,y\n", "line 2: more cells than columns"),
        "id_twice": (f"{HEAD}a,a,,\na,b,,\n", "more than once"),
        "id_empty": (f"{HEAD},a,,\n", "may not be empty"),
        "id_up": (f"{HEAD}..,a,,\n", "may not be empty or start with"),
        "id_slash": (f"{HEAD}a/b,a,,\n", "holds '/'"),
        "id_backslash": (f"{HEAD}a\\b,a,,\n", "holds"),
        "id_comma": (f'{HEAD}"a,b",a,,\n', "--assets"),
        "id_null": (f"{HEAD}null,a,,\n", "--assets"),
        "id_control": (f"{HEAD}a\x07b,a,,\n", "holds '\\x07'"),
        "id_escape": (f"{HEAD}\x1b[31ma,a,,\n", "holds '\\x1b'"),
        "id_invisible": (f"{HEAD}a\u200bb,a,,\n", "holds '\\u200b'"),
        "id_long": (f"{HEAD}{'x' * 201},a,,\n", "over 200 bytes"),
        "path_empty": (f"{HEAD}a,,,\n", "line 2: asset 'a' has no path"),
        "row_empty": (f"{HEAD}a,a,,\n,,,\n", "line 3: "),
        "support_unknown": ("asset_id,path,support\na,a,sky\n", "line 2: support 'sky'"),
        "up_unknown": ("asset_id,path,up\na,a,w\n", "line 2: up 'w'"),
    }


def _rows() -> dict[str, tuple[str, frozenset[FailureMode]]]:
    """Rows of a manifest that is right: its line, and what becomes of the asset."""
    return {
        "plain": ("plain,plain,Box,A box.", READ),
        "quoted": ('"quoted","quoted","Box","A ""small"", red box."', READ),
        "spaced": (" spaced , spaced , Box , A box. ", READ),
        "short": ("short,short", READ),
        "two_lines": ('two_lines,two_lines,Box,"A box,\nand its lid."', READ),
        "dots": ("dots,./x/../dots,Box,", READ),
        "slashes": ("slashes,slashes//,Box,", READ),
        "formula": ("formula,formula,=1+1,=HYPERLINK(1)", READ),
        "escapes": ("escapes,escapes,Box,\x1b[31mred\x1b[0m", READ),
        "inch": ('inch,inch,Box,A 12" box', READ),
        "unicode": ("unicode,unicode,Böx,Eine Kiste \U0001f600", READ),
        "gone": ("gone_row,nowhere,Box,", UNREADABLE),
        "capitals": ("capitals_row,CAPITALS,Box,", UNREADABLE),
        "itself": ("itself_row,.,Box,", UNREADABLE | READ),
        "variable": ("variable_row,$HOME,Box,", UNREADABLE),
        "home": ("home_row,~,Box,", UNREADABLE),
    }


def _manifest(content: str | bytes) -> Write:
    return lambda place: write_files(place.data, {"manifest.csv": content})
