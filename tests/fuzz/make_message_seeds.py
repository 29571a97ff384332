#!/usr/bin/env python3
"""Writes seeds for message_fuzz: one file for each message of every installed ROS type.

usage: make_message_seeds.py FOLDER
"""
import json
import pathlib
import subprocess
import sys
import tempfile

CORPUS = pathlib.Path(__file__).parent.parent / 'support' / 'make_message_corpus.py'


def main():
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        corpus = pathlib.Path(temporary) / 'corpus.jsonl'
        subprocess.run([sys.executable, str(CORPUS), str(corpus)], check=True)
        entries = [json.loads(line) for line in corpus.read_text('utf-8').splitlines()]
    for entry in entries:
        for number, message in enumerate(entry.get('messages', [])):
            text = f"{entry['type']}\n{entry['definition']}".encode('utf-8')
            seed = len(text).to_bytes(2, 'little') + text + bytes.fromhex(message['bytes'])
            (folder / f"{entry['type'].replace('/', '.')}-{number}").write_bytes(seed)


if __name__ == '__main__':
    main()
