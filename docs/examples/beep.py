"""A sound of one's own: any audio file, and an option of the group `sound` that names it."""

from pathlib import Path

import numpy as np
import soundfile

time = np.arange(4 * 16000) / 16000
beep = np.sin(2 * np.pi * 880 * time) * (time % 0.5 < 0.1)
soundfile.write("beep.wav", beep, 16000)
Path("my_conf/sound").mkdir(parents=True, exist_ok=True)
Path("my_conf/sound/phones.yaml").write_text(f"beep: {Path('beep.wav').resolve()}\nring: ring\n")
print("python -m avn.eval agent=greedy sound=beep.wav")
print("python -m avn.eval --config-dir my_conf agent=greedy sound=phones")
