"""Keys of clients on other machines: one small TOML file each, private, written whole or not at all.

The folder of a rig's keys holds `server.key`, the daemon's own pair, and `clients/NAME.key`, the public key
and the role of every client that is let in. A client's secret is written once, to a file of its own that is
taken to the client's machine, and is kept nowhere else. Revoking removes the client's file."""

from __future__ import annotations

import errno
import os
import re
import secrets
import stat
import time
import tomllib
from dataclasses import dataclass
from pathlib import Path

from rtctl.errors import ConfigError
from rtctl.wire.protocol import ROLES

SERVER_FILE = "server.key"
CLIENTS = "clients"
# no slash, and no dot at the begin: it becomes the name of a file
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_.-]{0,31}")
_Z85 = re.compile(r"[0-9a-zA-Z.\-:+=^!/*?&<>()\[\]{}@%$#]{40}")
# a key file has 200 bytes, with a name of 32 letters some 230
_MOST_BYTES = 4096
_PASSING = (errno.EMFILE, errno.ENFILE, errno.ENOMEM, errno.EIO, errno.EINTR)
"""What says nothing about the file, but of the moment."""


@dataclass(frozen=True)
class Key:
    """A client that is let in. `public_key` is text of 40 characters (Z85); `created` is UTC."""

    name: str
    role: str
    public_key: str
    created: str = ""


@dataclass(frozen=True)
class ClientKey:
    """What a client needs to be let in: its own pair and the daemon's public key."""

    name: str
    role: str
    public_key: str
    secret_key: str
    server_key: str

    @classmethod
    def load(cls, path: str | Path) -> ClientKey:
        """Read a client's key file.

        Raises
        ------
        ConfigError
            A file that is missing, readable by others, or no key file."""
        values = _read(Path(path), ("name", "role", "public_key", "secret_key", "server_key"), private=True)
        return cls(**values)


@dataclass(frozen=True)
class ServerKey:
    """The daemon's own pair."""

    public_key: str
    secret_key: str


class KeyStore:
    """The folder of a rig's keys.

    Parameters
    ----------
    folder
        Made by the first `new`, with mode 0700."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._clients = folder / CLIENTS

    def server(self) -> ServerKey:
        """The daemon's own pair. Raises ConfigError when there is none, or others could read it."""
        self._check_folders()
        path = self.folder / SERVER_FILE
        if not path.exists():
            raise ConfigError(
                f"{path}: no such file; make keys with: rtctl keys new NAME --dir {self.folder}"
            )
        return ServerKey(**_read(path, ("public_key", "secret_key"), private=True))

    def clients(self) -> tuple[dict[str, Key], list[str]]:
        """Clients that are let in, by public key, and one line for every file that cannot be used.

        Raises
        ------
        OSError
            The folder or a file cannot be read now: nothing is known."""
        # by the key itself, which is all that a connection shows; the name is for people
        found: dict[str, Key] = {}
        faults: list[str] = []
        try:
            # sorted: of two files with one key it is always the same one that counts
            paths = sorted(path for path in self._clients.iterdir() if path.suffix == ".key")
        except FileNotFoundError:
            paths = []
        for path in paths:
            try:
                values = _read(path, ("name", "role", "public_key", "created"), private=False)
                if values["name"] != path.stem:
                    raise ConfigError(f"{path}: name {values['name']!r} is not the file's name")
                found[values["public_key"]] = Key(**values)
            except ConfigError as error:
                if isinstance(error.__cause__, OSError) and error.__cause__.errno in _PASSING:
                    raise error.__cause__ from None
                faults.append(str(error))
        return found, faults

    def signature(self) -> tuple[tuple[str, int, int], ...]:
        """Changes whenever a client's file is added, removed or replaced. Raises OSError for a folder that
        cannot be read."""
        try:
            with os.scandir(self._clients) as entries:
                return tuple(sorted(_mark(entry) for entry in entries))
        except FileNotFoundError:
            return ()

    def new(self, name: str, role: str, out: Path) -> Path:
        """Make a client's pair, let it in, and write its secret to `out`; returns `out`.

        Raises
        ------
        ConfigError
            A name or a role that is none, a name or a file that is already there, or a folder that cannot be
            written."""
        if not _NAME.fullmatch(name):
            raise ConfigError(f"key name {name!r}: a letter, then at most 31 letters, digits, - _ or .")
        if role not in ROLES:
            raise ConfigError(f"role {role!r}: one of {', '.join(ROLES)}")
        entry = self._clients / f"{name}.key"
        if entry.exists():
            raise ConfigError(
                f"{entry}: there is a key of this name; revoke it first, or choose another name"
            )
        # asked before anything is made; `_write` asks again, at one go with the making
        if out.exists():
            raise ConfigError(f"{out}: exists already; give another file with --out")
        self._make_folders()
        # the first client of a rig makes the daemon's own pair, too
        server = self._server_made()
        public, secret = _pair()
        created = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
        facts = {"name": name, "role": role, "public_key": public}
        # the secret first: a key that nobody has got lets nobody in
        _write(out, {**facts, "secret_key": secret, "server_key": server.public_key}, like=None)
        try:
            _write(entry, {**facts, "created": created}, like=self.folder)
        except BaseException:
            out.unlink(missing_ok=True)
            raise
        return out

    def revoke(self, name: str) -> Key:
        """Let a client in no more. A daemon that runs closes its connections within about a second.

        Raises
        ------
        ConfigError
            No key of this name."""
        path = self._clients / f"{name}.key"
        if not _NAME.fullmatch(name) or not path.exists():
            known = ", ".join(sorted(entry.stem for entry in self._clients.glob("*.key"))) or "none"
            raise ConfigError(f"no key of the name {name!r} in {self.folder}; there are: {known}")
        try:
            key = Key(**_read(path, ("name", "role", "public_key", "created"), private=False))
        except ConfigError:  # it lets nobody in, and must not keep the name for ever
            key = Key(name, "damaged key", "")
        # the file is the permission: a daemon looks at the folder twice a second
        path.unlink()
        return key

    def _server_made(self) -> ServerKey:
        if not (self.folder / SERVER_FILE).exists():
            public, secret = _pair()
            _write(self.folder / SERVER_FILE, {"public_key": public, "secret_key": secret}, like=self.folder)
        return self.server()

    def _make_folders(self) -> None:
        for folder in (self.folder, self._clients):
            try:
                folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            except OSError as error:
                raise ConfigError(f"{folder}: cannot make the folder of keys: {error.strerror}") from error
        # made by sudo: the daemon's user must be able to read it
        if self._clients.stat().st_uid != self.folder.stat().st_uid and os.geteuid() == 0:
            os.chown(self._clients, self.folder.stat().st_uid, self.folder.stat().st_gid)
        self._check_folders()

    def _check_folders(self) -> None:
        """Refuse a folder others could put keys into."""
        for folder in (self.folder, self._clients):
            try:
                status = folder.stat()
            except OSError as error:
                raise ConfigError(
                    f"{folder}: {error.strerror}; make keys with: rtctl keys new NAME --dir {self.folder}"
                ) from error
            # whoever owns the folder could put a key of their own into it
            if status.st_uid not in (0, os.geteuid()) and os.geteuid() != 0:
                raise ConfigError(f"{folder}: belongs to user {status.st_uid}, not to {os.geteuid()} or root")
            if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
                raise ConfigError(f"{folder}: others may write there; run: chmod go-w {folder}")


def _mark(entry: os.DirEntry[str]) -> tuple[str, int, int]:
    """Name, number and time of a file; of the link itself where it leads nowhere or to itself."""
    try:
        status = entry.stat()
    except OSError:
        status = entry.stat(follow_symlinks=False)
    return entry.name, status.st_ino, status.st_mtime_ns


def _pair() -> tuple[str, str]:
    # here: who only reads keys loads no ZeroMQ
    import zmq

    public, secret = zmq.curve_keypair()  # Z85, 40 characters each
    return public.decode(), secret.decode()


def _write(path: Path, values: dict[str, str], like: Path | None) -> None:
    """Write a private file whole or not at all; owned as the folder `like` when root writes it."""
    # beside it: a link is within one file system; its ending keeps it out of the list of keys
    draft = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    text = "".join(f'{key} = "{value}"\n' for key, value in values.items())
    try:
        fd = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
        try:
            # all of it, or an error: a single `os.write` may take a part (a quota, a disk almost full)
            with os.fdopen(fd, "wb", closefd=False) as file:
                file.write(text.encode())
            if like is not None and os.geteuid() == 0:
                os.fchown(fd, like.stat().st_uid, like.stat().st_gid)
            os.fsync(fd)  # the content before the name
        finally:
            os.close(fd)
        os.link(draft, path)  # fails when somebody else was quicker, where a rename would replace
    except FileExistsError:
        raise ConfigError(f"{path}: exists already") from None
    except OSError as error:
        raise ConfigError(f"{path}: cannot write the key: {error.strerror}") from error
    finally:
        draft.unlink(missing_ok=True)


def _read(path: Path, names: tuple[str, ...], *, private: bool) -> dict[str, str]:
    """The values of a key file, checked."""
    try:
        # a FIFO would wait for its writer
        fd = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
        try:
            mode = os.fstat(fd).st_mode
            raw = os.read(fd, _MOST_BYTES) if stat.S_ISREG(mode) else b""
        finally:
            os.close(fd)
    except OSError as error:
        raise ConfigError(f"{path}: cannot read the key: {error.strerror}") from error
    if not stat.S_ISREG(mode):
        raise ConfigError(f"{path}: not a file: a key is a small text file; remove it")
    if private and mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise ConfigError(f"{path}: others may read this secret; run: chmod 600 {path}")
    try:
        values = tomllib.loads(raw.decode())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: not a key file: {error}") from error
    # exactly: a file with more may be meant for a later version, whose further words would be ignored here
    if set(values) != set(names):
        raise ConfigError(
            f"{path}: a key file has {', '.join(names)}, this one {', '.join(values) or 'nothing'}"
        )
    for name, value in values.items():
        if not isinstance(value, str) or (name.endswith("_key") and not _Z85.fullmatch(value)):
            raise ConfigError(f"{path}: {name}: not a key of 40 characters")
    # of a later version, or misspelled: what it may do nobody can tell
    if "role" in values and values["role"] not in ROLES:
        raise ConfigError(f"{path}: role {values['role']!r}: one of {', '.join(ROLES)}")
    return values
