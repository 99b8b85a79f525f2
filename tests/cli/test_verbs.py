"""list, info, new, validate, schema, doctor: what they print and how they end."""

import json
import socket
import subprocess

import jsonschema
import pytest
import yaml

from tests.command import SPARKS, command, environment, warpsim


def test_list_names_every_shipped_scene():
    plain, machine = warpsim("list"), warpsim("list", "--json")
    assert plain.returncode == machine.returncode == 0
    scenes = json.loads(machine.stdout)
    assert "campfire" in {scene["scene"] for scene in scenes}
    assert [line.split()[0] for line in plain.stdout.splitlines()] == [scene["scene"] for scene in scenes]
    assert all(scene["description"] for scene in scenes)


def test_info_of_a_scene():
    result = warpsim("info", "campfire")
    assert (
        result.returncode == 0
        and "Campfire" in result.stdout
        and "capacity" in result.stdout
        and "bytes per particle: 63 (state 56" in result.stdout
    )
    told = json.loads(warpsim("info", "campfire", "--json").stdout)
    assert told["scene"]["name"] == "Campfire"
    assert told["memory_bytes"] >= sum(system["total"] for system in told["memory"].values()) > 0


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("systems.particles.capacity", ["134217728", "1"]),
        ("time.fps", ["60", "1/s"]),
        ("flow.vortex.circulation", ["m^2/s"]),
    ],
)
def test_info_of_a_field(path, words):
    result = warpsim("info", path)
    assert result.returncode == 0, result.stderr
    assert all(word in result.stdout for word in words), result.stdout
    assert json.loads(warpsim("info", path, "--json").stdout)["field"] == path


@pytest.mark.parametrize(("name", "meant"), [("campfir", "campfire"), ("systems.particles.capacty", "capacity")])
def test_info_suggests(name, meant):
    result = warpsim("info", name)
    assert result.returncode == 2 and meant in result.stderr and "Traceback" not in result.stderr


def test_new_writes_a_scene_that_validates_and_runs(tmp_path):
    made = warpsim("new", "my_first-scene.yaml", cwd=tmp_path)
    assert made.returncode == 0, made.stderr
    assert (tmp_path / "my_first-scene.yaml").read_text().startswith("# yaml-language-server: $schema=scene.schema.json\n")
    assert json.loads((tmp_path / "scene.schema.json").read_text())["type"] == "object"
    assert warpsim("validate", "my_first-scene.yaml", cwd=tmp_path).returncode == 0
    run = warpsim("run", "my_first-scene.yaml", "--viewer", "none", "--frames", 120, "--json", cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    sparks = json.loads(run.stdout)["systems"]["sparks"]
    assert sparks["live"] > 1000 and sparks["refused"] == 0


def test_the_starter_obeys_its_schema(tmp_path):
    warpsim("new", "scene.yaml", cwd=tmp_path)
    starter = yaml.safe_load((tmp_path / "scene.yaml").read_text())
    jsonschema.validate(starter, json.loads((tmp_path / "scene.schema.json").read_text()))


def test_new_overwrites_nothing(tmp_path):
    (tmp_path / "mine.yaml").write_text("precious")
    (tmp_path / "scene.schema.json").write_text("{}")
    result = warpsim("new", "mine.yaml", cwd=tmp_path)
    assert result.returncode == 5 and "mine.yaml" in result.stderr
    assert warpsim("new", "other.yaml", cwd=tmp_path).returncode == 0
    assert (tmp_path / "mine.yaml").read_text() == "precious" and (tmp_path / "scene.schema.json").read_text() == "{}"


def test_validate_tells_every_mistake_of_every_scene(tmp_path):
    (tmp_path / "good.yaml").write_text(SPARKS)
    (tmp_path / "bad.yaml").write_text(SPARKS.replace("capacity", "capacty").replace("fps: 60", "fps: -1"))
    result = warpsim("validate", "good.yaml", "bad.yaml", cwd=tmp_path)
    assert result.returncode == 3
    assert "good.yaml: ok" in result.stdout and "bad.yaml:3:" in result.stderr and "did you mean capacity" in result.stderr
    good, bad = json.loads(warpsim("validate", "good.yaml", "bad.yaml", "--json", cwd=tmp_path).stdout)
    assert good["ok"] and not bad["ok"] and {problem["line"] for problem in bad["problems"]} >= {3}
    assert warpsim("validate", "good.yaml", cwd=tmp_path).returncode == 0


def test_schema(tmp_path):
    assert json.loads(warpsim("schema").stdout)["type"] == "object"
    assert warpsim("schema", "--out", tmp_path / "s.json").returncode == 0
    assert (tmp_path / "s.json").read_text() == warpsim("schema").stdout
    assert warpsim("schema", "--out", tmp_path / "s.json" / "below_a_file").returncode == 5


def test_doctor_checks_everything_and_says_what_to_do():
    result = warpsim("doctor", "--json")
    findings = {finding["topic"]: finding for finding in json.loads(result.stdout)}
    assert {"Python", "Warp", "CPU", "GPU", "kernel cache", "port", "browser", "disk (here)", "extra bench"} <= findings.keys()
    assert all(finding["remedy"] for finding in findings.values() if finding["state"] != "ok")
    assert result.returncode == any(finding["state"] == "fail" for finding in findings.values())
    plain = warpsim("doctor")
    assert all(topic in plain.stdout for topic in findings)


def test_doctor_sees_a_port_in_use():
    with socket.socket() as taken:
        taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            taken.bind(("127.0.0.1", 7000))
        except OSError:
            pass  # somebody else holds it: just as well
        findings = {finding["topic"]: finding for finding in json.loads(warpsim("doctor", "--json").stdout)}
    assert findings["port"]["state"] == "warn"


def test_doctor_fails_where_something_is_broken(tmp_path):
    (tmp_path / "warp.py").write_text("raise ImportError('no such luck')\n")
    result = warpsim("doctor", cwd=tmp_path, PYTHONPATH=str(tmp_path))
    assert result.returncode == 1 and "no such luck" in result.stdout and "Traceback" not in result.stdout + result.stderr


def test_version_and_help():
    from warpsim import __version__

    assert warpsim("--version").stdout.strip() == f"warpsim {__version__}"
    help_text = warpsim("--help").stdout
    assert all(f"\n  {verb} " in help_text for verb in "run view list info new validate schema doctor".split())


@pytest.mark.parametrize(
    "arguments", [["rnu", "campfire"], ["run"], ["run", "campfire", "--frames", "many"], ["run", "campfire", "--what"], []]
)
def test_usage_mistakes_end_with_2(arguments):
    result = warpsim(*arguments)
    assert result.returncode == 2 and "Traceback" not in result.stderr


def test_unknown_verb_is_suggested():
    assert "Did you mean 'run'?" in warpsim("rnu").stderr


def test_a_reader_that_leaves_is_no_error_to_talk_about(tmp_path):
    process = subprocess.Popen(command("schema"), stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment())
    process.stdout.close()
    assert process.stderr.read() == b"" and process.wait() == 5


@pytest.mark.parametrize("arguments", [["list"], ["run", "campfire", "--viewer", "none", "--frames", "1"]])
def test_output_onto_a_full_disk_ends_with_5(arguments):
    with open("/dev/full", "w") as full:
        done = subprocess.run(command(*arguments), stdout=full, stderr=subprocess.PIPE, env=environment(), text=True)
    assert done.returncode == 5 and done.stderr.splitlines() == ["error: No space left on device"]


def test_closed_and_narrow_streams(tmp_path):
    closed = subprocess.run(f"{' '.join(command('list'))} >&- 2>&-", shell=True, env=environment())
    assert closed.returncode == 0
    (tmp_path / "fireworks.yaml").write_text(SPARKS.replace("name: Sparks", "name: 花火 …"))
    narrow = warpsim("info", "fireworks.yaml", cwd=tmp_path, PYTHONIOENCODING="latin-1")
    assert narrow.returncode == 0 and "??" in narrow.stdout, narrow.stderr


def test_a_missing_package_is_named(tmp_path):
    (tmp_path / "sitecustomize.py").write_text("import sys\nsys.modules['typer'] = None\n")
    done = warpsim("list", PYTHONPATH=str(tmp_path))
    assert done.returncode == 5 and "the package typer is missing" in done.stderr and len(done.stderr.splitlines()) == 1
