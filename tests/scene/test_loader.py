"""YAML 1.2 rules, limits and files: every refusal is a SceneError with a line and a column, none takes long."""

import os

import pytest

from warpsim.scene import SceneError, UnknownSceneError, load_scene, load_text, shipped_scenes
from warpsim.scene.yaml12 import LARGEST_FILE, decode, parse


def refused(text: str | bytes) -> list:
    with pytest.raises(SceneError) as error:
        load_text(decode(text, "s.yaml") if isinstance(text, bytes) else text, "s.yaml")
    return error.value.problems


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 1e-3),
        ("1E5", 1e5),
        (".5", 0.5),
        ("1.", 1.0),
        ("-.5e+1", -5.0),
        ("010", 10),
        ("+7", 7),
        ("0x1F", 31),
        ("0o17", 15),
        ("no", "no"),
        ("on", "on"),
        ("yes", "yes"),
        ("1:30", "1:30"),
        ("1_000", "1_000"),
        ("2026-01-02", "2026-01-02"),
        ("0b11", "0b11"),
        ("~", None),
        ("Null", None),
        ("", None),
        ("TRUE", True),
        ("false", False),
        ('"1"', "1"),
        ("'true'", "true"),
        ("=", "="),
        ("e5", "e5"),
        ("1e", "1e"),
        (".", "."),
    ],
)
def test_plain_scalars_follow_the_core_schema(text, value):
    node, problems = parse(f"a: {text}\n", "s.yaml")
    found = node.data()["a"]
    assert found == value and type(found) is type(value) and not problems


@pytest.mark.parametrize(
    ("text", "line", "column", "says"),
    [
        ("", 1, 1, "empty"),
        ("# only a comment\n", 1, 1, "empty"),
        ("---\n", 2, 1, "mapping"),
        ("- 1\n", 1, 1, "mapping"),
        ("just text\n", 1, 1, "mapping"),
        ("a: 1\na: 2\n", 2, 1, "first in line 1"),
        ("name: x\nseed: 1\n---\nname: y\n", 3, 1, "second document"),
        ("name: !!python/object/apply:os.system [id]\n", 1, 7, "tags"),
        ("name: !x y\n", 1, 7, "tags"),
        ("!!map\nname: x\n", 1, 1, "tags"),
        ("%TAG ! tag:x,2000:\n---\nname: x\n", 1, 1, "%TAG"),
        ("a: &x [*x]\n", 1, 8, "inside of what it repeats"),
        ("a: *b\n", 1, 4, "nothing is marked"),
        ("? [1]\n: 2\n", 1, 3, "one word"),
        ("? {a: 1}\n: 2\n", 1, 3, "one word"),
        ("*a : 1\n", 1, 1, "nothing is marked"),
        ("<<: {name: x}\n", 1, 1, "merge keys"),
        ("seed: " + "9" * 5000 + "\n", 1, 7, "5000 digits"),
        ("seed: 1e400\n", 1, 7, "too large"),
        ("seed: .nan\n", 1, 7, "not a finite"),
        ("seed: -.inf\n", 1, 7, "not a finite"),
        ("name: a\tb\n\tseed: 1\n", 2, 1, "tab"),
        ("name: x\n  seed: 1\n", 2, 7, ":"),
        ("name: [1, 2\nseed: 3\n", 1, 7, '"[" is not closed'),
        ("name: {a: 1\nseed: 3\n", 1, 7, '"{" is not closed'),
        ("name: 'x\nseed: 3\n", 1, 7, "quote"),
        ("name: @x\n", 1, 7, "in quotes"),
        ("name: `x\n", 1, 7, "in quotes"),
        ('name: "\\q"\n', 1, 8, "escape"),
        ("name: a\x00b\n", 1, 8, "NUL"),
        ("name: a\x1bb\n", 1, 8, "U+001B"),
        ("name: a\u2028b\n", 1, 8, "U+2028"),
        ("name: a\ufeffb\n", 1, 8, "U+FEFF"),
        ('name: "a\\0b"\n', 1, 7, "control character"),
        (b"\xff\xfen\x00", 1, 1, "UTF-16"),
        (b"name: x\nseed: \xff\n", 2, 7, "0xff is not UTF-8"),
        (b"name: \xc3\n", 1, 7, "not UTF-8"),
        (b"\xef\xbb\xbf", 1, 1, "empty"),
    ],
)
def test_what_is_no_scene_is_refused_at_its_place(text, line, column, says):
    problems = refused(text)
    assert any(says in problem.message and (problem.line, problem.column) == (line, column) for problem in problems), problems


def _bomb() -> str:
    lines = ["name: x", "flow:", " - &a0 [1, 2, 3, 4, 5, 6, 7, 8, 9]"]
    return "\n".join([*lines, *(f" - &a{k + 1} [{', '.join([f'*a{k}'] * 9)}]" for k in range(9))])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[" * 100_000, "deeper than 64"),
        ("- " * 100_000, "deeper than 64"),
        ("a: " + "[" * 65 + "]" * 65, "deeper than 64"),
        ("a: [" + "1, " * 200_000 + "]", "more than 10000 entries"),
        ("".join(f"k{k}: 1\n" for k in range(60_000)), "more than 10000 entries"),
        ("".join(f"k{k}: [{'a, ' * 9_000}]\n" for k in range(30)), "more than 200000 values"),
        ("a: &a 1\nb: [" + "*a, " * 1001 + "]", "more than 1000 aliases"),
        (_bomb(), "once the aliases are spelled out"),
        ("a: &a " + "[" * 40 + "]" * 40 + "\nb: " + "[" * 40 + "*a" + "]" * 40, "deeper than 64 levels once *a is spelled out"),
        ("x" * (LARGEST_FILE + 1), "larger than 1 MiB"),
        ("name: " + "é" * (LARGEST_FILE // 2), "larger than 1 MiB"),
        ("name: x\n" * 100_000, "given twice"),
        ("name: x\nflow:\n" + "- {type: rotatio, angular_velocty: 1}\n" * 4000, "unknown type"),
        ("name: x\nflow:\n" + "- {type: rotation, angular_velocity: 1}\n" * 9000, "at most 4096 entries"),
        ("name: x\nflow: [{type: vortex, circulation: {keyframes: [" + "[a, b], " * 9_900 + "]}}]", "expected a number"),
        ("name: x\nsystems:\n" + "".join(f" a{k}: {{}}\n" for k in range(9_000)), '"type" is missing'),
        ("name: x\nflow: [{type: rotation, angular_velocity: {expression: '" + "(" * 1_900 + "'}}]", "nested deeper"),
        ("#" * 1_000_000, "empty"),
        ("\t" * 100_000, "tab"),
        (":" * 500_000, ":"),
        ("'" * 500_000, "mapping"),
    ],
    ids=lambda value: value[:24],
)
def test_limits_hold_and_are_told(text, says):
    problems = refused(text)
    assert any(says in problem.message for problem in problems), str(SceneError(problems[:3]))


def test_anchors_stand_for_what_they_repeat():
    scene = load_text("name: x\nflow:\n- &a {type: rotation, angular_velocity: 2}\n- *a\n")
    assert scene.flow[0] == scene.flow[1]


def test_a_byte_order_mark_and_windows_line_ends_are_fine():
    text = decode(b"\xef\xbb\xbfname: x\r\nsead: 1\r\n", "s.yaml")
    (problem,) = refused(text)
    assert (problem.line, problem.column, problem.suggestion) == (2, 1, "seed")


def test_long_lines_are_cut_round_the_caret():
    (problem,) = refused("name: x\ngravity: [0, " + " " * 300 + "fast, 0]" + " " * 50 + "# end\n")
    _, line, caret = str(problem).splitlines()
    assert len(line) < 120 and line[caret.index("^") :].startswith("fast")


def test_files(tmp_path, monkeypatch):
    good = tmp_path / "good.yaml"
    good.write_text("name: good\n")
    assert load_scene(good).name == load_scene(str(good)).name == "good"
    assert load_scene(good, seed=5).seed == 5
    for path, says in ((tmp_path, "folder"), (tmp_path / "goood.yaml", "no such file"), (tmp_path / "no" / "x.yaml", "no such file")):
        with pytest.raises(SceneError, match=says):
            load_scene(path)
    with pytest.raises(SceneError, match="did you mean .*good.yaml"):
        load_scene(tmp_path / "god.yaml")
    os.mkfifo(tmp_path / "pipe.yaml")
    with pytest.raises(SceneError, match="regular file"):
        load_scene(tmp_path / "pipe.yaml")
    with pytest.raises(SceneError):
        load_scene("a\0b.yaml")

    def denied(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.open", denied)
    with pytest.raises(SceneError, match="cannot be read: Permission denied"):
        load_scene(good)


def test_shipped_scenes_load_by_name():
    for name, path in shipped_scenes().items():
        assert load_scene(name) == load_scene(path)


@pytest.mark.parametrize("name", ["", "campfyre", "no such scene", "..", "a" * 10_000])
def test_an_unknown_name_is_told_with_the_nearest(name):
    with pytest.raises(UnknownSceneError) as error:
        load_scene(name)
    if name == "campfyre" and "campfire" in shipped_scenes():
        assert error.value.problems[0].suggestion == "campfire"
