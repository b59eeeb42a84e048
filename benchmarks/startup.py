"""Time and memory of commands that have nothing to do, against `import torch`.

Each command runs in a process of its own, in turn with ``python -c "import torch"``: help, a
misspelt option, a setting that is not read, the table of a finished run, and a finished training.
`import torch` does other work: it is the unit of the ratios, since a command that imports torch
cannot be faster, and no competitor.
The figures are the least of the repetitions: processor seconds, wall-clock seconds and peak memory.

Run from the repository: ``python benchmarks/startup.py``.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time

TORCH = ("-c", "import torch")
RUN = ("-m", "avn.eval", "agent=greedy", "split=mini", "sound_model.epochs=1")
TRAINING = ("-m", "avn.train", "model=sound_cnn", "split=mini", "sound_model.epochs=1")


def commands(outputs):
    """Return the arguments of each command, by what it does."""
    return {
        "import torch": TORCH,
        "help": ("-m", "avn.eval", "--help"),
        "misspelt option": ("-m", "avn.eval", "agent=greddy"),
        "misspelt setting": ("-m", "avn.eval", "agent=greedy", "protocol.max_step=5"),
        "setting that is not read": ("-m", "avn.eval", "agent=greedy", "mapper.size=51"),
        "finished run": (*RUN, f"outputs={outputs}"),
        "finished training": (*TRAINING, f"outputs={outputs}"),
    }


def run(arguments):
    """Return processor seconds, wall-clock seconds and peak memory in MB of a new process."""
    begin = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    _, _, used = os.wait4(process.pid, 0)
    process.returncode = 0
    wall = time.perf_counter() - begin
    return used.ru_utime + used.ru_stime, wall, used.ru_maxrss / 1024


def main():
    """Print the figures of each command and their ratio to `import torch`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    repeats = parser.parse_args().repeats
    with tempfile.TemporaryDirectory() as outputs:
        measured = {name: [] for name in commands(outputs)}
        run((*RUN, f"outputs={outputs}"))  # makes the run and the training, and compiles
        for _ in range(repeats):
            for name, arguments in commands(outputs).items():
                measured[name].append(run(arguments))
    peer = [min(column) for column in zip(*measured["import torch"], strict=True)]
    for name, runs in measured.items():
        cpu, wall, memory = (min(column) for column in zip(*runs, strict=True))
        print(
            f"{name:25} {cpu:6.2f} CPU-s {wall:6.2f} s {memory:5.0f} MB; "
            f"{cpu / peer[0]:.2f} of the processor time of import torch, {wall / peer[1]:.2f} of "
            "its wall-clock time"
        )


if __name__ == "__main__":
    main()
