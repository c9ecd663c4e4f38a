import errno
import json
import os
import resource
import stat

import pytest
from click.testing import CliRunner

from rtctl.cli.keys import command
from rtctl.errors import ConfigError
from rtctl.wire.keys import ClientKey, KeyStore


@pytest.fixture
def store(tmp_path):
    return KeyStore(tmp_path / "keys")


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def test_a_new_key_is_private_and_its_secret_is_kept_nowhere_else(store, tmp_path):
    old = os.umask(0)
    try:
        out = store.new("anna", "renderer", tmp_path / "anna.key")
    finally:
        os.umask(old)
    key = ClientKey.load(out)
    entry = store.folder / "clients" / "anna.key"
    assert [mode(path) for path in (out, entry, store.folder / "server.key")] == [0o600] * 3
    assert (mode(store.folder), mode(entry.parent)) == (0o700, 0o700)
    assert key.server_key == store.server().public_key
    assert all(key.secret_key not in path.read_text() for path in store.folder.rglob("*.key"))
    keys, faults = store.clients()
    assert (keys[key.public_key].name, keys[key.public_key].role, faults) == ("anna", "renderer", [])


def test_the_daemons_own_pair_stays_when_more_clients_come(store, tmp_path):
    store.new("anna", "renderer", tmp_path / "a.key")
    before = store.server()
    store.new("ben", "operator", tmp_path / "b.key")
    assert store.server() == before
    assert {key.name for key in store.clients()[0].values()} == {"anna", "ben"}


def test_nothing_is_overwritten_and_nothing_is_left_half_made(store, tmp_path):
    out = store.new("anna", "renderer", tmp_path / "a.key")
    text = out.read_text()
    with pytest.raises(ConfigError, match="revoke it first"):
        store.new("anna", "operator", tmp_path / "other.key")
    with pytest.raises(ConfigError, match="exists already"):
        store.new("ben", "operator", out)
    assert out.read_text() == text
    assert not (tmp_path / "other.key").exists()
    assert sorted(path.name for path in (store.folder / "clients").iterdir()) == ["anna.key"]


@pytest.mark.parametrize("name", ["", "../x", "a/b", "-x", "a" * 33, "a\n", 'a"b'])
def test_names_that_could_be_paths_are_refused(store, tmp_path, name):
    with pytest.raises(ConfigError, match="key name"):
        store.new(name, "observer", tmp_path / "x.key")
    with pytest.raises(ConfigError):
        store.revoke(name)


def test_revoking_removes_the_client_and_names_the_others_when_there_is_none(store, tmp_path):
    store.new("anna", "renderer", tmp_path / "a.key")
    before = store.signature()
    with pytest.raises(ConfigError, match="there are: anna"):
        store.revoke("ben")
    assert store.revoke("anna").role == "renderer"
    assert store.clients() == ({}, [])
    assert store.signature() != before


def test_secrets_others_can_read_and_folders_others_can_write_are_refused(store, tmp_path):
    out = store.new("anna", "renderer", tmp_path / "a.key")
    out.chmod(0o640)
    with pytest.raises(ConfigError, match="chmod 600"):
        ClientKey.load(out)
    (store.folder / "server.key").chmod(0o604)
    with pytest.raises(ConfigError, match="chmod 600"):
        store.server()
    (store.folder / "server.key").chmod(0o600)
    (store.folder / "clients").chmod(0o770)
    with pytest.raises(ConfigError, match="chmod go-w"):
        store.server()


def test_a_missing_folder_says_what_to_do(store):
    with pytest.raises(ConfigError, match="rtctl keys new"):
        store.server()


@pytest.mark.parametrize(
    "text",
    ["", "name = 1", 'name = "x"', "\xff", 'name = "bad"\nrole = "king"\npublic_key = "x"\ncreated = ""'],
)
def test_a_damaged_entry_lets_nobody_in_and_is_named(store, tmp_path, text):
    store.new("anna", "renderer", tmp_path / "a.key")
    (store.folder / "clients" / "bad.key").write_text(text, "latin-1")
    keys, faults = store.clients()
    assert [key.name for key in keys.values()] == ["anna"]
    assert "bad.key" in faults[0]
    with pytest.raises(ConfigError, match="revoke it first"):
        store.new("bad", "observer", tmp_path / "b.key")
    assert store.revoke("bad").name == "bad"
    assert store.new("bad", "observer", tmp_path / "b.key").exists()


def test_the_command_makes_lists_and_revokes(tmp_path):
    run = CliRunner()
    folder = ["--dir", str(tmp_path / "keys"), "--json"]
    made = run.invoke(
        command, ["new", "anna", "--role", "operator", "--out", str(tmp_path / "a.key"), *folder]
    )
    assert json.loads(made.output)["role"] == "operator"
    listed = json.loads(run.invoke(command, ["list", *folder]).output)
    assert [key["name"] for key in listed["keys"]] == ["anna"]
    assert json.loads(run.invoke(command, ["revoke", "anna", *folder]).output)["revoked"]["name"] == "anna"
    assert json.loads(run.invoke(command, ["list", *folder]).output)["keys"] == []
    text = run.invoke(
        command, ["new", "ben", "--role", "observer", "--out", str(tmp_path / "b.key"), *folder[:2]]
    )
    secret = ClientKey.load(tmp_path / "b.key").secret_key
    assert "observer ben" in text.output
    assert secret not in text.output


def test_a_link_to_itself_a_fifo_and_a_folder_are_no_keys_and_keep_nobody_waiting(tmp_path):
    store = KeyStore(tmp_path / "keys")
    store.new("anna", "operator", tmp_path / "anna.key")
    clients = tmp_path / "keys" / "clients"
    (clients / "loop.key").symlink_to("loop.key")
    (clients / "nowhere.key").symlink_to("gone")
    os.mkfifo(clients / "pipe.key")
    (clients / "folder.key").mkdir()
    found, faults = store.clients()
    assert [key.name for key in found.values()] == ["anna"]
    assert [name for name in ("folder", "loop", "nowhere",
        "pipe") if any(f"{name}.key" in one for one in faults)] == [
        "folder", "loop", "nowhere", "pipe",
    ]  # fmt: skip
    before = store.signature()
    (clients / "loop.key").unlink()
    assert store.signature() != before


@pytest.mark.parametrize("number", [errno.EMFILE, errno.ENFILE, errno.EIO])
def test_what_cannot_be_read_for_the_moment_is_not_taken_for_gone(tmp_path, monkeypatch, number):
    store = KeyStore(tmp_path / "keys")
    store.new("anna", "operator", tmp_path / "anna.key")

    def refuse(*_args, **_more):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(OSError, match=os.strerror(number)):
        store.clients()
    monkeypatch.setattr(os, "scandir", refuse)
    with pytest.raises(OSError, match=os.strerror(number)):
        store.signature()


def test_a_key_for_which_there_is_no_room_is_none(store, tmp_path):
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, before[1]))  # less than a key has, as a quota
    try:
        with pytest.raises(ConfigError, match="cannot write the key"):
            store.new("anna", "renderer", tmp_path / "a.key")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert not (tmp_path / "a.key").exists()
    assert store.new("anna", "renderer", tmp_path / "a.key").exists()
