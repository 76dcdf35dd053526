"""A pack for the Hugging Face Hub (``asset2sim pack OUT --for huggingface --out PACK``), read as its users read it: the
table by ``datasets``, and a row's object by the loader of the pack.

    python examples/huggingface_dataset.py PACK-OR-USER/NAME
"""

import sys

from datasets import load_dataset

for row in load_dataset(sys.argv[1], split="train"):
    picture = row["preview"]
    print(f"{row['name']}: {row['mass_kg']:.3g} kg, {row['joints']} joints, {picture.width} x {picture.height} pixels")
