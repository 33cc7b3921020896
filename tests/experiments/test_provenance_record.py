"""A result names the commit its code comes from, and names none rather than a wrong one."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from vslam_ref.support import provenance

pytestmark = pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed")


def git(clone: Path, *arguments: str) -> str:
    identity = ["-c", "user.name=n", "-c", "user.email=e@example.org", "-c", "commit.gpgsign=false"]
    command = ["git", "-C", str(clone), *identity, *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


@pytest.fixture
def clone(tmp_path) -> Path:
    root = tmp_path / "clone"
    (root / "vslam_ref").mkdir(parents=True)
    (root / "vslam_ref" / "code.py").write_text("x = 1\n")
    git(root, "init", "-q")
    git(root, "add", ".")
    git(root, "commit", "-qm", "first")
    return root


def test_code_run_from_a_clone_gives_its_commit_and_whether_it_was_changed(clone, monkeypatch):
    monkeypatch.setattr(provenance, "PACKAGE", clone / "vslam_ref")
    head = git(clone, "rev-parse", "HEAD")
    assert provenance.git_state() == (head, False)
    (clone / "vslam_ref" / "code.py").write_text("x = 2\n")
    assert provenance.git_state() == (head, True)


def test_an_installed_copy_gives_the_commit_of_its_clone_only_while_both_are_equal(
    clone, tmp_path, monkeypatch
):
    installed = tmp_path / "site-packages" / "vslam_ref"
    shutil.copytree(clone / "vslam_ref", installed)
    monkeypatch.setattr(provenance, "PACKAGE", installed)
    monkeypatch.setattr(provenance, "_installed_from", lambda: {"url": clone.as_uri(), "dir_info": {}})
    assert provenance.git_state() == (git(clone, "rev-parse", "HEAD"), False)
    (clone / "vslam_ref" / "code.py").write_text("x = 2\n")
    assert provenance.git_state() == (None, None)


def test_an_installation_from_an_address_gives_the_commit_it_recorded(tmp_path, monkeypatch):
    monkeypatch.setattr(provenance, "PACKAGE", tmp_path / "vslam_ref")
    record = {"url": "https://example.org/x.git", "vcs_info": {"vcs": "git", "commit_id": "abc"}}
    monkeypatch.setattr(provenance, "_installed_from", lambda: record)
    assert provenance.git_state() == ("abc", False)


@pytest.mark.parametrize("record", [{}, {"url": "https://example.org/x.whl"}, {"url": "file:///nowhere"}])
def test_no_known_origin_gives_no_commit(record, tmp_path, monkeypatch):
    monkeypatch.setattr(provenance, "PACKAGE", tmp_path / "vslam_ref")
    monkeypatch.setattr(provenance, "_installed_from", lambda: record)
    assert provenance.git_state() == (None, None)


def test_versions_are_plain_and_complete():
    versions = provenance.versions()
    assert json.loads(json.dumps(versions)) == versions
    assert versions["numpy"]
    assert versions["python"].startswith("3.")
