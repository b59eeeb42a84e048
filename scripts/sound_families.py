"""List of the synthesised sounds: cells of the parameters of each family, with frozen splits.

Cells of different splits of a family differ in every parameter that changes its timbre.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import sound_synthesis as syn


@dataclass(frozen=True)
class Family:
    """Synthesised sound: its name, split, words for a table, function and parameters."""

    name: str
    split: str
    title: str
    function: Callable[..., Any]
    parameters: tuple[Any, ...]


ODE = "64 64 65 67 67 65 64 62 60 60 62 64 64 - 62 62"
MINUET = "74 67 69 71 72 74 - 67 - 67 76 72 74 76 78 79"
FRERE = "72 74 76 72 72 74 76 72 76 77 79 - 76 77 79 -"
WESTMINSTER = (415.3, 369.99, 329.63, 246.94, 0.0)

F = Family
SYNTHESISED = [
    F("telephone_black", "train", "telephone with two gongs", syn.ringing_bell,
      ((1180.0, 1490.0), 20.0, 0.25, 1.0, 0.5)),
    F("telephone_wall", "validation", "telephone with two gongs", syn.ringing_bell,
      ((890.0, 1035.0), 24.0, 0.4, 0.8, 0.6)),
    F("telephone_kitchen", "test", "telephone with two gongs", syn.ringing_bell,
      ((1630.0, 1910.0), 15.0, 0.16, 1.3, 0.7)),
    F("telephone_office", "train", "electronic ringer", syn.warble,
      ((1300.0, 1600.0), 14.0, 1.0, 0.5, 0.5)),
    F("telephone_desk", "train", "electronic ringer", syn.warble,
      ((520.0, 660.0, 790.0), 22.0, 0.7, 0.6, 0.8)),
    F("telephone_cordless", "validation", "electronic ringer", syn.warble,
      ((2050.0, 2500.0), 9.0, 1.2, 0.4, 0.2)),
    F("telephone_fax", "test", "electronic ringer", syn.warble,
      ((930.0, 1120.0), 30.0, 0.9, 0.7, 0.0)),
    F("telephone_ode", "train", "melody (Beethoven)", syn.melody, (ODE, 0.2, 0.8, 0.12)),
    F("telephone_minuet", "test", "melody (Petzold)", syn.melody, (MINUET, 0.16, 0.0, 0.2)),
    F("alarm_travel", "train", "travel alarm clock", syn.beeps, (2048.0, 0.06, 0.06, 4, 0.5, 0.3)),
    F("alarm_radio", "train", "alarm of a clock radio", syn.beeps, (980.0, 0.3, 0.3, 1, 0.0, 0.7)),
    F("alarm_car", "train", "car alarm", syn.siren, (600.0, 1400.0, 0.5, 0.8)),
    F("alarm_fridge", "validation", "open refrigerator", syn.beeps,
      (1560.0, 0.15, 0.1, 2, 0.4, 0.15)),
    F("alarm_smoke", "test", "smoke detector", syn.beeps, (3150.0, 0.5, 0.35, 3, 0.4, 0.5)),
    F("alarm_wind_up", "test", "wind-up alarm clock", syn.ringing_bell,
      ((2350.0, 2720.0), 28.0, 0.1, 2.0, 0.1)),
    F("alarm_yelp", "test", "siren", syn.siren, (380.0, 900.0, 1.4, 0.5)),
    F("clock_wall", "train", "wall clock", syn.ticking, ((2600.0, 4100.0), 0.006, 2.0, 0.88, 0.6)),
    F("clock_pocket", "train", "pocket watch", syn.ticking, ((5200.0, 6900.0), 0.003, 5.0, 0.96, 0.3)),
    F("clock_cuckoo", "train", "cuckoo clock", syn.cuckoo, (735.0, 590.0, 0.06, 1.1)),
    F("clock_mantel", "validation", "mantel clock", syn.ticking,
      ((1250.0, 1900.0, 3300.0), 0.018, 2.7, 0.8, 0.2)),
    F("clock_pendulum", "test", "grandfather clock", syn.ticking,
      ((420.0, 760.0, 1500.0), 0.035, 1.7, 0.72, 0.4)),
    F("clock_kitchen", "test", "kitchen timer", syn.ticking, ((3400.0, 3750.0), 0.004, 8.0, 1.0, 1.2)),
    F("doorbell_ding_dong", "train", "two bars", syn.chimes, ((659.3, 523.3), 0.8, 0.7, syn.BAR)),
    F("doorbell_three", "train", "three tubes", syn.chimes,
      ((784.0, 622.3, 466.2), 0.6, 0.9, syn.TUBE)),
    F("doorbell_buzzer", "train", "buzzer", syn.buzzer, (100.0, 0.2, 0.8, 0.3)),
    F("doorbell_low", "validation", "two bars", syn.chimes, ((440.0, 349.2), 0.9, 1.1, syn.BAR)),
    F("doorbell_westminster", "test", "Westminster chime", syn.chimes,
      (WESTMINSTER, 0.65, 1.3, syn.TUBE)),
    F("doorbell_rasp", "test", "buzzer", syn.buzzer, (62.0, 0.8, 0.5, 0.4)),
    F("doorbell_electric", "test", "electric bell", syn.ringing_bell,
      ((2010.0,), 11.0, 0.3, 0.9, 0.6)),
    F("water_drip", "train", "dripping tap", syn.bubbles, (3.0, 900.0, 1500.0, 0.02, 3.0)),
    F("water_gutter", "validation", "drops in a gutter", syn.bubbles, (9.0, 300.0, 700.0, 0.04, 3.0)),
    F("water_sink", "test", "drops in a sink", syn.bubbles, (5.0, 1900.0, 3300.0, 0.012, 3.0)),
    F("kettle_whistle", "train", "whistle", syn.whistle, ((2100.0,), 0.004, 0.1, 0.1, 0.0)),
    F("kettle_two_tones", "train", "two whistles", syn.whistle,
      ((1250.0, 1580.0), 0.01, 0.25, 0.2, 0.02)),
    F("kettle_pan", "train", "water boils in a pan", syn.boiling, (60.0, 300.0, 900.0, 0.5, 0.0)),
    F("kettle_electric", "train", "electric kettle", syn.boiling, (25.0, 150.0, 400.0, 2.0, 0.0)),
    F("kettle_shrill", "validation", "whistle", syn.whistle, ((3300.0,), 0.002, 0.5, 0.3, 0.05)),
    F("kettle_simmer", "validation", "water simmers", syn.boiling, (30.0, 700.0, 1500.0, 0.2, 0.0)),
    F("kettle_harmonica", "test", "three whistles", syn.whistle,
      ((880.0, 1109.0, 1319.0), 0.006, 0.15, 0.1, 0.0)),
    F("kettle_hoarse", "test", "hoarse whistle", syn.whistle, ((2650.0,), 0.03, 1.2, 0.5, 0.08)),
    F("kettle_lid", "test", "lid rattles on boiling water", syn.boiling,
      (90.0, 500.0, 1200.0, 0.8, 9.0)),
    F("dog_large", "train", "large dog", syn.calls,
      ((190.0, 260.0, 150.0), (480.0, 1050.0, 2300.0), 0.22, 0.3, 0.5)),
    F("dog_terrier", "train", "terrier", syn.calls,
      ((700.0, 980.0, 620.0), (1100.0, 2100.0, 3400.0), 0.12, 0.2, 0.3)),
    F("dog_whine", "train", "a dog whines", syn.calls,
      ((800.0, 1250.0, 900.0), (1000.0, 2400.0), 0.6, 0.3, 0.08)),
    F("dog_gruff", "validation", "gruff dog", syn.calls,
      ((120.0, 150.0, 105.0), (380.0, 820.0, 1900.0), 0.3, 0.35, 0.9)),
    F("dog_hound", "validation", "hound", syn.calls,
      ((330.0, 430.0, 410.0, 280.0), (650.0, 1300.0, 2700.0), 0.45, 0.3, 0.2)),
    F("dog_puppy", "test", "puppy", syn.calls,
      ((1000.0, 1500.0, 1150.0), (1500.0, 2900.0), 0.09, 0.25, 0.15)),
    F("cat_young", "train", "young cat", syn.calls,
      ((750.0, 900.0, 700.0), (1400.0, 2700.0, 4100.0), 0.5, 0.35, 0.05)),
    F("cat_tom", "train", "tomcat", syn.calls,
      ((380.0, 520.0, 480.0, 330.0), (900.0, 1700.0, 3000.0), 0.8, 0.3, 0.1)),
    F("cat_hungry", "validation", "hungry cat", syn.calls,
      ((560.0, 720.0, 640.0), (1150.0, 2200.0, 3600.0), 0.65, 0.25, 0.07)),
    F("cat_purr", "test", "a cat purrs", syn.buzzer, (26.0, -0.6, 1.1, 0.15)),
    F("cat_trill", "test", "a cat trills", syn.calls,
      ((480.0, 620.0, 500.0, 660.0, 540.0, 830.0), (1000.0, 1950.0), 0.4, 0.3, 0.03)),
    F("door_knock", "train", "knocks on wood", syn.knocks,
      ((160.0, 290.0, 520.0), 0.05, 4.0, 3, 0.3)),
    F("door_tap", "train", "knocks on a thin panel", syn.knocks,
      ((410.0, 690.0, 1150.0), 0.03, 6.0, 4, 0.4)),
    F("door_heavy", "validation", "knocks on a heavy door", syn.knocks,
      ((85.0, 140.0, 330.0), 0.09, 2.8, 2, 0.3)),
    F("door_metal", "test", "knocks on metal", syn.knocks,
      ((240.0, 830.0, 1470.0, 2600.0), 0.12, 3.3, 3, 0.35)),
    F("fire_stove", "train", "stove", syn.crackling, (14.0, 800.0, 5000.0, 0.6, 0.1)),
    F("fire_camp", "validation", "camp fire", syn.crackling, (40.0, 400.0, 2500.0, 1.2, 0.3)),
    F("fire_embers", "test", "embers", syn.crackling, (7.0, 1800.0, 7000.0, 0.15, 0.05)),
    F("fire_frying", "test", "frying pan", syn.crackling, (160.0, 2500.0, 7000.0, 0.1, 0.6)),
    F("appliance_fridge", "train", "refrigerator", syn.motor,
      (50.0, -0.9, (80.0, 900.0, 0.3), 0.0, 0.0)),
    F("appliance_vacuum", "train", "vacuum cleaner", syn.motor,
      (310.0, -0.5, (500.0, 6000.0, 1.5), 0.0, 0.0)),
    F("appliance_washing", "train", "washing machine", syn.motor,
      (37.0, -0.4, (100.0, 1500.0, 0.8), 1.5, 0.7)),
    F("appliance_fan", "validation", "fan", syn.motor, (88.0, -1.2, (150.0, 2500.0, 2.5), 0.6, 0.3)),
    F("appliance_dryer", "validation", "hair dryer", syn.motor,
      (205.0, -0.8, (900.0, 4500.0, 2.5), 0.0, 0.0)),
    F("appliance_mixer", "test", "hand mixer", syn.motor,
      (145.0, 0.0, (1500.0, 7000.0, 0.5), 3.0, 0.3)),
    F("appliance_hood", "test", "cooker hood", syn.motor, (62.0, -1.5, (60.0, 1200.0, 4.0), 0.0, 0.0)),
    F("appliance_microwave", "test", "microwave oven that has finished", syn.beeps,
      (2300.0, 0.6, 0.3, 3, 0.2, 0.1)),
]
