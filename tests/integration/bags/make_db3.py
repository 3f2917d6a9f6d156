#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes a bag of rosbag2's older kind of what make_mcap.mjs serialized, by Python's sqlite3.

    make_db3.py MESSAGES.cdr OUT_FOLDER [split=N] [wal] [message-zstd] [no-metadata]

split: so many files. wal: as a recorder that was killed leaves it, the messages in FILE-wal. message-zstd: each message
compressed by the program zstd.
"""
import json
import os
import shutil
import sqlite3
import subprocess
import sys
from pathlib import Path


def messages(file):
    with open(file, "rb") as stream:
        while line := stream.readline():
            head = json.loads(line)
            yield head, stream.read(head["size"])


def create(file):
    database = sqlite3.connect(file)
    database.executescript(
        "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
        "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);"
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
        "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, "
        "data BLOB NOT NULL);"
        "CREATE INDEX timestamp_idx ON messages (timestamp ASC);")
    return database


def main():
    source, out, options = sys.argv[1], Path(sys.argv[2]), sys.argv[3:]
    split = next((int(o[6:]) for o in options if o.startswith("split=")), 1)
    out.mkdir(parents=True, exist_ok=True)
    everything = list(messages(source))
    names = []
    for part in range(split):
        file = out / f"{out.name}_{part}.db3"
        names.append(file.name)
        database = create(file)
        if "wal" in options:
            database.execute("PRAGMA journal_mode=WAL")
            database.execute("PRAGMA wal_autocheckpoint=0")
        topics = {}
        for head, data in everything[part * len(everything) // split:(part + 1) * len(everything) // split]:
            if head["topic"] not in topics:
                topics[head["topic"]] = len(topics) + 1
                database.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')",
                                 (topics[head["topic"]], head["topic"], head["type"]))
            if "message-zstd" in options:
                data = subprocess.run(["zstd", "-q", "-c"], input=data, stdout=subprocess.PIPE, check=True).stdout
            database.execute("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)",
                             (topics[head["topic"]], int(head["time"]), data))
        database.commit()
        if "wal" in options:  # copied while the recorder still has it open
            for ending in ("", "-wal"):
                shutil.copy(f"{file}{ending}", f"{file}.copy{ending}")
            database.close()
            for ending in ("", "-wal"):
                os.replace(f"{file}.copy{ending}", f"{file}{ending}")
        else:
            database.close()
    if "no-metadata" not in options:
        (out / "metadata.yaml").write_text(
            "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  relative_file_paths:\n"
            + "".join(f"    - {name}\n" for name in names))


main()
