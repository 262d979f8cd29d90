# SPDX-License-Identifier: Apache-2.0
"""A directory that is renamed or removed by others."""

import shutil

import pytest
from towtank_bag.held_directory import HeldDirectory, make_directory


def test_it_is_followed_where_it_goes(tmp_path):
    held = make_directory(tmp_path / "a" / "b")
    assert held.path == tmp_path / "a" / "b"
    (tmp_path / "a").rename(tmp_path / "c")
    held.write("one", "1")
    assert held.path == tmp_path / "c" / "b"
    (tmp_path / "a" / "b").mkdir(parents=True)  # another of the same name
    held.rename("one", "two")
    assert (tmp_path / "c" / "b" / "two").read_text() == "1"
    assert held.has("two")
    held.remove("two")
    assert not held.has("two")
    held.close()
    assert held.path == tmp_path / "c" / "b"


def test_the_name_that_was_given_is_kept(tmp_path):
    """A link's too: that is where its user looks for it."""
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    assert HeldDirectory(tmp_path / "link").path == tmp_path / "link"


def test_one_that_is_removed_is_known_to_be(tmp_path):
    held = make_directory(tmp_path / "a")
    assert not held.removed
    shutil.rmtree(tmp_path / "a")
    assert held.removed
    assert held.path == tmp_path / "a"
    with pytest.raises(FileNotFoundError):
        held.write("one", "1")


def test_one_that_is_there_is_not_made(tmp_path):
    with pytest.raises(FileExistsError):
        make_directory(tmp_path)
