# SPDX-License-Identifier: Apache-2.0
"""A trial's ROS domain and temporary folders, and what is said of variables that cannot work."""

from __future__ import annotations

import errno
import os
import socket
import tempfile

import pytest
from towtank_bringup.environment import (
    DISCOVERY_RANGES,
    EnvironmentProblem,
    as_text,
    check_ros_variables,
    is_text,
    ros_domain,
    runtime_folder,
    short_temporary_folder,
)


@pytest.fixture
def temporary_folder(monkeypatch):
    """Sets TMPDIR; Python looks at it once only."""

    def set_to(folder):
        monkeypatch.setenv("TMPDIR", os.fsdecode(folder))
        monkeypatch.setattr(tempfile, "tempdir", None)

    return set_to


@pytest.mark.parametrize("empty", [False, True])
def test_domain_is_given_back_and_an_error_passes(monkeypatch, empty):
    if empty:
        monkeypatch.setenv("ROS_DOMAIN_ID", "")
    else:
        monkeypatch.delenv("ROS_DOMAIN_ID")
    for _ in range(2):
        with pytest.raises(OSError, match="No space left"), ros_domain() as domain:
            assert 1 <= domain <= 100
            assert os.environ["ROS_DOMAIN_ID"] == str(domain)
            with ros_domain():  # one that is set is kept
                assert os.environ["ROS_DOMAIN_ID"] == str(domain)
            raise OSError(errno.ENOSPC, "No space left on device")
        assert not os.environ.get("ROS_DOMAIN_ID")


@pytest.mark.parametrize("domain", ["300", "233", "-1", "lab", "1.5", " 7", "٣", "0x10"])
def test_domain_that_cannot_be_is_named(monkeypatch, domain):
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    with (
        pytest.raises(EnvironmentProblem, match=r"ROS_DOMAIN_ID is .*: give 0 to 232"),
        ros_domain(),
    ):
        pass


@pytest.mark.parametrize("discovery", ["OFF", "localhost", "NOT_SET", "1"])
def test_discovery_range_that_parts_the_nodes_is_named(monkeypatch, discovery):
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", discovery)
    with pytest.raises(EnvironmentProblem, match=r"ROS_AUTOMATIC_DISCOVERY_RANGE is .*LOCALHOST"):
        check_ros_variables()


@pytest.mark.parametrize("discovery", ["", *DISCOVERY_RANGES])
@pytest.mark.parametrize("domain", ["", "0", "42", "232"])
def test_wishes_that_can_be_are_kept(monkeypatch, domain, discovery):
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", discovery)
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    assert check_ros_variables() == (int(domain) if domain else None)
    with ros_domain() as taken:
        assert not domain or taken == int(domain)


@pytest.mark.parametrize("kind", ["plain", "long", "bytes", "missing"])
def test_socket_can_be_made_whatever_the_temporary_folder(tmp_path, temporary_folder, kind):
    folder = {
        "plain": tmp_path,
        "long": tmp_path / "long" / ("scratch_of_the_laboratory" * 4),
        "bytes": tmp_path / os.fsdecode(b"tow_\xe9"),
        "missing": tmp_path / "missing",
    }[kind]
    if kind != "missing":
        folder.mkdir(parents=True, exist_ok=True)
    temporary_folder(folder)
    with runtime_folder() as runtime, socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(runtime / "bench"))
        assert is_text(runtime)
    assert not runtime.exists()


def test_temporary_folder_is_named_if_none_will_do(temporary_folder, tmp_path):
    temporary_folder(tmp_path)
    with pytest.raises(EnvironmentProblem, match=r"TMPDIR is .*: set it to a folder"):
        short_temporary_folder(room=107)


@pytest.mark.parametrize("name", ["rig", "tow 🐟", 'a "quoted" {b}: #c', "jürgen"])
def test_path_that_is_text_is_passed_as_it_is(tmp_path, name):
    assert as_text(tmp_path / name, tmp_path, "link") == tmp_path / name


@pytest.mark.parametrize("name", [b"tow_\xe9t\xe9", b"two\nlines", b"bell\x07", b"\xff"])
def test_path_that_is_no_text_gets_a_link(tmp_path, name):
    """Also to what will be made later, as a trial's directory is."""
    odd = tmp_path / os.fsdecode(name)
    link = as_text(odd, tmp_path, "link")
    assert as_text(odd, tmp_path, "link") == link == tmp_path / "link"
    odd.mkdir()
    assert link.samefile(odd)
