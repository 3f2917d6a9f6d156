#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The packages, made and tried: run_packages.py ROOT BUILD WORK packages|root|image|service

packages  makes them of what is built, follows the links of the installed pages, compares what the CMake package finds with
          the dependencies of the -dev package, and has lintian look at them
image     the steps of the Dockerfile's last stage, in such a root: no Docker engine is needed
root      installs them with apt in a minimal Debian root of their own, maps, draws, reports, runs Python, builds and runs a
          project that finds the library and the examples, upgrades from a lower version, removes all; nothing may be left
service   what systemd says of the hub's unit

Exit code 77 where lintian, mmdebstrap, the right to make a root, or the network to fill it are not there.
"""
import json
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "layers"))
import check_docs

SKIPPED = 77
SUITE = "bookworm"
PACKAGES = ["plumbline", "plumbline-net", "plumbline-ros1", "libplumbline-dev", "python3-plumbline", "plumbline-doc"]
DEVELOPMENT = "libplumbline-dev"
CONSUMER_GB = 8
ROOT_GB = 2
# What a run in the root leaves aside, by design of the tools themselves.
LEFT_ALONE = re.compile(r"^(proc|sys|dev|tmp|run|packages|root/\.cache|var/(cache|log|lib/(apt|dpkg|systemd))|etc/ld\.so\.cache)")


def run(*command, **options):
    print("+", *command, flush=True)
    return subprocess.run([str(word) for word in command], check=True, text=True, **options)


def skip(why):
    print(why)
    sys.exit(SKIPPED)


def packages(build):
    return sorted((build / "packages").glob("*.deb"))


def make(build):
    shutil.rmtree(build / "packages", ignore_errors=True)
    run("cmake", "--build", build, "--target", "plumbline_cli")
    run("cpack", "--config", build / "CPackConfig.cmake", cwd=build, stdout=subprocess.DEVNULL)
    names = {deb.name.split("_")[0] for deb in packages(build)}
    missing = set(PACKAGES) - names
    if "python3-plumbline" in missing and not (build / "lib" / "python").exists():
        missing.remove("python3-plumbline")
    assert not missing, f"packages that are not made: {missing}"


def unpacked(build, work, *names):
    """A folder with the files of these packages."""
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    for deb in packages(build):
        if deb.name.split("_")[0] in names:
            run("dpkg-deb", "-x", deb, work)
    return work


def check_pages(build, work):
    """Links of the installed pages lead somewhere."""
    pages = unpacked(build, work / "doc", "plumbline-doc") / "usr/share/doc/plumbline-doc"
    problems = check_docs.check_links(pages)
    assert len(check_docs.pages(pages)) > 40 and not problems, "\n".join(problems)


def names_of(depends):
    """Names of a Depends field; of alternatives all."""
    return [re.split(r"[ (:]", name.strip())[0] for name in re.split(r"[,|]", depends) if name.strip()]


def closure(names):
    """These packages, what they provide, and all that they depend on, as far as it is installed here."""
    said = run("dpkg-query", "-W", "-f", "${Package}\t${Provides}\t${Pre-Depends}, ${Depends}\n", stdout=subprocess.PIPE).stdout
    needs, providers = {}, {}
    for package, provides, depends in (line.split("\t") for line in said.splitlines()):
        needs[package] = names_of(depends)
        for name in [package, *names_of(provides)]:
            providers.setdefault(name, set()).add(package)
    found, left = set(), list(names)
    while left:
        for package in providers.get(left.pop(), set()) - found:
            found.add(package)
            left += needs[package]
    return found


def check_development(root, build, work):
    """The package of the library depends on all that its CMake package finds."""
    prefix = unpacked(build, work / "dev", DEVELOPMENT, "plumbline") / "usr"
    run("cmake", "-S", root / "tests" / "consumer", "-B", work / "consumer", "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={prefix}",
        stdout=subprocess.DEVNULL)
    files = (work / "consumer" / "interface_files.txt").read_text().split()
    [deb] = (build / "packages").glob(DEVELOPMENT + "_*.deb")
    depends = run("dpkg-deb", "-f", deb, "Depends", stdout=subprocess.PIPE).stdout
    known = closure(names_of(depends))
    said = subprocess.run(["dpkg", "-S", *files], text=True, capture_output=True).stdout
    owners = {file: set(names_of(names)) for names, file in (line.split(": ", 1) for line in said.splitlines())}
    missing = {file: sorted(owners.get(file, [])) for file in files if not owners.get(file, set()) & known}
    assert len(files) > 2 and not missing, f"{DEVELOPMENT} does not depend on the packages of {missing}"


def check_packages(root, build, work):
    make(build)
    check_pages(build, work)
    check_development(root, build, work)
    for deb in packages(build):
        depends = subprocess.run(["dpkg-deb", "-f", deb, "Depends"], capture_output=True, text=True, check=True).stdout
        print(f"{deb.name}: {deb.stat().st_size / 1e6:.2f} MB; {depends.strip()}")
        if "-doc" not in deb.name and "-dev" not in deb.name:
            assert "libc6" in depends, f"{deb.name}: dpkg-shlibdeps has found nothing"
    if shutil.which("lintian") is None:
        skip("lintian is not installed (scripts/install-deps --judges)")
    said = subprocess.run(["lintian", "--allow-root", "--fail-on", "error", *map(str, packages(build))], text=True,
                          capture_output=True)
    print(said.stdout, said.stderr)
    return said.returncode


class Root:
    """A minimal Debian, entered with chroot."""

    def __init__(self, folder):
        self.folder = folder

    def make(self):
        made = subprocess.run(["mmdebstrap", "--variant=apt", "--quiet", "--aptopt=APT::Install-Recommends false", SUITE,
                               str(self.folder)], text=True, capture_output=True)
        if made.returncode != 0:
            skip(f"mmdebstrap cannot make a {SUITE} root here: {made.stderr.strip().splitlines()[-1:]}")
        # The proxy and sources of this machine hold in there, too.
        for file in Path("/etc/apt/apt.conf.d").glob("*proxy*"):
            shutil.copy(file, self.folder / "etc/apt/apt.conf.d")

    def run(self, script, **options):
        """A shell script in the root, with /proc and /dev for that long."""
        enter = (f"mount -t proc proc {self.folder}/proc && mount --rbind /dev {self.folder}/dev && "
                 f"exec chroot {self.folder} env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 "
                 "DEBIAN_FRONTEND=noninteractive bash -euc \"$0\"")
        print("+ (root)", script.strip().splitlines()[0], flush=True)
        return subprocess.run(["unshare", "-m", "bash", "-euc", enter, script], check=True, text=True, **options)

    def apt(self, words):
        """apt-get, heard of only when it fails."""
        self.run(f"apt-get {words} >/tmp/apt.log 2>&1 || {{ tail -n 40 /tmp/apt.log; exit 1; }}; apt-get clean")

    def files(self):
        found = set()
        for folder, folders, names in os.walk(self.folder):
            at = os.path.relpath(folder, self.folder)
            folders[:] = [name for name in folders if not LEFT_ALONE.match(os.path.normpath(os.path.join(at, name)))]
            found |= {os.path.normpath(os.path.join(at, name)) for name in names}
        return {file for file in found if not LEFT_ALONE.match(file)}


def lower_version(deb, work):
    """The same package with a version below its own."""
    folder = work / "lower" / deb.stem
    folder.parent.mkdir(parents=True, exist_ok=True)
    run("dpkg-deb", "-R", deb, folder)
    control = folder / "DEBIAN" / "control"
    text = control.read_text()
    version = re.search(r"^Version: (.*)$", text, re.M).group(1)
    control.write_text(text.replace(version, version + "~before"))
    run("dpkg-deb", "--root-owner-group", "-b", folder, work / "lower" / f"{deb.stem}.deb", stdout=subprocess.DEVNULL)


MAP = """
plumbline --version
plumbline map "synth:room?frames=60&width=320&height=240" -o /tmp/room -q
plumbline render /tmp/room -o /tmp/room.png
plumbline report /tmp/room
test -s /tmp/room/map.ply && test -s /tmp/room.png && test -s /tmp/room/report.html
"""
DEMO = """
cd /packages/source && scripts/demo --package /packages/world/robot0 | tee /tmp/said
head -n 3 /tmp/said | grep -q "this will install the package"
grep -q "a picture: demo/robot0/snapshots/iso.png" /tmp/said
test -s demo/robot0/snapshots/iso.png && test -s demo/robot0/report.html && test -x /usr/bin/plumbline
rm -r demo
"""
MISSING = """
plumbline hub -o /tmp/hub --interface lo --robots 1 2>&1 | tee /tmp/said || true
grep -q "install the package plumbline-net" /tmp/said
plumbline convert /tmp/nothing.mcap /tmp/copy 2>&1 | tee /tmp/said || true
"""
PYTHON = """
python3 /packages/run_examples.py /usr/share/doc/plumbline-doc/examples/python plumbline /tmp/python
"""
NETWORK = """
/usr/share/doc/plumbline-doc/examples/network/two_robots.sh $(command -v plumbline) /tmp/network 212
"""
# The quickest to compile.
CMAKE = "cmake -G Ninja -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0"
CONSUMER = f"""
{CMAKE} -S /packages/consumer -B /tmp/consumer >/dev/null
cmake --build /tmp/consumer >/dev/null
mkdir -p /tmp/consumed && /tmp/consumer/consumer /tmp/consumed
"""
# All at once, and one of them copied and alone.
EXAMPLES = f"""
examples=/usr/share/doc/plumbline-doc/examples
{CMAKE} -S $examples -B /tmp/examples >/dev/null
cmake --build /tmp/examples >/dev/null
ctest --test-dir /tmp/examples --parallel 2 --output-on-failure
test $(ls $examples/*/CMakeLists.txt | wc -l) = $(ctest --test-dir /tmp/examples -N | grep -c "Test *#")
cp -r $examples/01_map /tmp/alone
{CMAKE} -S /tmp/alone -B /tmp/alone/build >/dev/null
cmake --build /tmp/alone/build >/dev/null
ctest --test-dir /tmp/alone/build --output-on-failure --no-tests=error
"""


def check_root(root, build, work):
    if os.geteuid() != 0 or shutil.which("mmdebstrap") is None:
        skip("a root is made by root with mmdebstrap (scripts/install-deps --judges)")
    if not packages(build):
        make(build)
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    if not space_for(ROOT_GB, work):
        skip(f"a root needs {ROOT_GB} GB of disk")
    debian = Root(work / "root")
    debian.make()
    try:
        try_packages(root, build, work, debian)
    finally:
        shutil.rmtree(debian.folder, ignore_errors=True)
    return 0


def space_for(gigabytes, work):
    return shutil.disk_usage(work).free > gigabytes * 1e9


def try_demo(root, build, debian):
    """scripts/demo --package in a copy of the source that nothing was built in: the package is installed, not compiled."""
    source = debian.folder / "packages" / "source"
    shutil.copytree(root / "scripts", source / "scripts")
    shutil.copytree(build / "packages", source / "build" / "release" / "packages",
                    ignore=lambda _d, names: [name for name in names if not name.startswith("plumbline_")])
    run(build / "bin" / "plumbline", "synth", "room", "-o", debian.folder / "packages" / "world", "--frames", 30,
        "--width", 320, "--height", 240, "-q")
    debian.run(DEMO)


def try_consumer(root, debian):
    """A project of its own finds the library, and so do the examples."""
    shutil.copytree(root / "tests" / "consumer", debian.folder / "packages" / "consumer")
    begin = time.monotonic()
    debian.apt("install -y -qq /packages/libplumbline-dev_*.deb g++ cmake ninja-build")
    installed = time.monotonic()
    debian.run(CONSUMER)
    consumed = time.monotonic()
    debian.run(EXAMPLES)
    print(f"{DEVELOPMENT} installed in {installed - begin:.0f} s, consumer {consumed - installed:.0f} s, "
          f"examples {time.monotonic() - consumed:.0f} s")


def try_packages(root, build, work, debian):
    for deb in packages(build):
        if not deb.name.startswith(DEVELOPMENT):
            lower_version(deb, work)
    shutil.copytree(work / "lower", debian.folder / "packages" / "lower", ignore=lambda _d, names:
                    [name for name in names if not name.endswith(".deb")])
    for deb in packages(build):
        shutil.copy(deb, debian.folder / "packages")
    debian.run("apt-get update -qq")
    before = debian.files()

    begin = time.monotonic()
    debian.apt("install -y -qq /packages/plumbline_*.deb")
    installed = time.monotonic()
    debian.run(MAP)
    print(f"installed in {installed - begin:.0f} s, from there to picture and report {time.monotonic() - installed:.0f} s")
    debian.run(MISSING)
    debian.apt("remove -y -qq plumbline")
    try_demo(root, build, debian)
    debian.apt("install -y -qq --allow-downgrades /packages/lower/*.deb")
    debian.apt(f"install -y -qq $(ls /packages/*.deb | grep -v {DEVELOPMENT})")
    debian.run("dpkg-query -W -f '${Version}\\n' plumbline plumbline-net python3-plumbline | { ! grep before; }")
    shutil.copy(root / "tests" / "python" / "run_examples.py", debian.folder / "packages")
    debian.run(PYTHON)
    debian.run(NETWORK)
    with_consumer = space_for(CONSUMER_GB, work)
    if with_consumer:
        try_consumer(root, debian)
    debian.run("man -w plumbline-map >/dev/null 2>&1 || test -e /usr/share/man/man1/plumbline-map.1.gz || "
               "echo 'man pages are left out of this root by its dpkg settings'")

    wanted = " ".join([*PACKAGES, "g++", "cmake", "ninja-build"])
    debian.apt(f"purge -y -qq --autoremove $(dpkg-query -W -f '${{Package}} ' {wanted} 2>/dev/null)")
    left = sorted(file for file in debian.files() - before if "plumbline" in file)
    assert not left, f"left behind after the removal: {left}"
    if not with_consumer:
        skip(f"all but {DEVELOPMENT} was tried: its dependencies need {CONSUMER_GB} GB of disk, which are not there")


def stage_steps(dockerfile):
    """Instructions of the last stage with their arguments, lines that go on joined."""
    text = re.sub(r"\\\n", " ", "".join(line for line in dockerfile.read_text().splitlines(True) if not line.startswith("#")))
    steps = [line.split(None, 1) for line in text.splitlines() if line.strip()]
    last = max(number for number, step in enumerate(steps) if step[0] == "FROM")
    return steps[last + 1:]


def check_image(root, build, work):
    """The packages are those of the first stage, which runs scripts/package."""
    if os.geteuid() != 0 or shutil.which("mmdebstrap") is None:
        skip("a root is made by root with mmdebstrap (scripts/install-deps --judges)")
    if not packages(build):
        make(build)
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    debian = Root(work / "root")
    debian.make()
    try:
        shutil.copytree(build / "packages", debian.folder / "packages", ignore=lambda _d, names:
                        [name for name in names if not name.endswith(".deb")])
        user, entry, folder = "root", [], "/"
        for instruction, argument in stage_steps(root / "Dockerfile"):
            if instruction == "RUN":
                debian.run(argument)
            elif instruction == "USER":
                user = argument.strip()
            elif instruction == "WORKDIR":
                folder = argument.strip()
            elif instruction == "ENTRYPOINT":
                entry = json.loads(argument)
        assert user != "root" and entry == ["plumbline"], "the image runs as root, or something else"
        debian.run(f"mkdir -p {folder} && chown {user} {folder} && cd {folder} && "
                   f"su {user} -c '{entry[0]} map synth:room?frames=20\\&width=160\\&height=120 -o out -q && test -s out/map.ply'")
        assert not (debian.folder / "packages").exists(), "the image still has the packages"
    finally:
        shutil.rmtree(debian.folder, ignore_errors=True)
    return 0


def check_service(root, _build, _work):
    if shutil.which("systemd-analyze") is None:
        skip("systemd-analyze is not installed")
    unit = root / "scripts" / "plumbline-hub.service"
    said = subprocess.run(["systemd-analyze", "verify", "--man=no", str(unit)], capture_output=True, text=True)
    about_it = [line for line in said.stderr.splitlines() if "plumbline-hub" in line and "not executable" not in line]
    print("\n".join(about_it))
    exposure = subprocess.run(["systemd-analyze", "security", "--offline=true", "--threshold=40", str(unit)],
                              capture_output=True, text=True)
    print("\n".join(exposure.stdout.splitlines()[-2:]), exposure.stderr)
    return 1 if about_it or exposure.returncode != 0 else 0


if __name__ == "__main__":
    check = {"packages": check_packages, "root": check_root, "image": check_image, "service": check_service}[sys.argv[4]]
    sys.exit(check(*(Path(argument).resolve() for argument in sys.argv[1:4])))
