"""`vsep.recordings.configurations`: files of sensors' tools, written here by their documents."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from vsep.errors import InputError
from vsep.recordings.configurations.configuration import Said
from vsep.recordings.configurations.consequences import consequences, lines_of
from vsep.recordings.configurations.registry import (
    for_recording,
    merged,
    read_configuration,
)
from vsep.recordings.settings import parse_settings
from vsep.signal.radar import ChirpSequence

CFG = """\
% Platform:xWR18xx
sensorStop
channelCfg 15 5 0
adcCfg 2 1
adcbufCfg -1 0 1 1 1
profileCfg 0 77 7 6 57.14 0 0 29.982 1 128 10000 0 0 158
chirpCfg 0 0 0 0 0 0 0 1
chirpCfg 1 1 0 0 0 0 0 4
frameCfg 0 1 16 0 100 1 0
lvdsStreamCfg -1 0 1 0
"""
LUA = """\
local SLOPE = 29.982
ar1.SelectChipVersion("XWR1443")
ar1.ChanNAdcConfig(1, 0, 1, 1, 0, 1, 0, 2, 2, 0)
ar1.ProfileConfig(0, 77, 100, 6, 60, 0, 0, 0, 0, 0, 0, SLOPE, 0, 256, 10000, 0, 0, 30) -- usual
ar1.ChirpConfig(0, 0, 0, 0, 0, 0, 0, 1, 0, 0)
ar1.ChirpConfig(1, 1, 0, 0, 0, 0, 0, 0, 0, 1)
ar1.FrameConfig(0, 1, 8, 64, 40, 0, 1)
"""
# 77 GHz in 3.6 GHz/2^26, 30 MHz/us in 3.6 GHz/2^26 900/s, times in 10 ns and 5 ns
LOG = """\
1-Jan 10:00:00: API:select_chip_version,AR1642,0,
1-Jan 10:00:00: API:ChannelConfig,3,15,0,
1-Jan 10:00:00: API:AdcOutConfig,2,2,0,
1-Jan 10:00:01: API:ProfileConfig,0,1435388860,700,600,5714,0,0,621,0,128,10000,0,0,30,0,
1-Jan 10:00:01: API:ChirpConfig,0,0,0,0,0,0,0,1,0,
1-Jan 10:00:01: API:FrameConfig,0,0,8,32,8000000,0,256,0,
"""
STUDIO = {
    "mmWaveDevices": [
        {
            "partNumber": "xwr6843",
            "rfConfig": {
                "rlChanCfg_t": {"rxChannelEn": "0xF", "txChannelEn": "0x7"},
                "rlAdcOutCfg_t": {"fmt": {"b2AdcBits": 2, "b2AdcOutFmt": 1}},
                "rlProfiles": [
                    {
                        "rlProfileCfg_t": {
                            "profileId": 0,
                            "startFreqConst_GHz": 60.0,
                            "idleTimeConst_usec": 7.0,
                            "adcStartTimeConst_usec": 6.0,
                            "rampEndTime_usec": 57.14,
                            "freqSlopeConst_MHz_usec": 29.982,
                            "numAdcSamples": 128,
                            "digOutSampleRate": 10000,
                        }
                    }
                ],
                "rlChirps": [
                    {
                        "rlChirpCfg_t": {
                            "chirpStartIdx": index,
                            "chirpEndIdx": index,
                            "profileId": 0,
                            "txEnable": hex(1 << index),
                        }
                    }
                    for index in range(3)
                ],
                "rlFrameCfg_t": {
                    "chirpStartIdx": 0,
                    "chirpEndIdx": 2,
                    "numLoops": 10,
                    "framePeriodicity_msec": 100,
                },
            },
        }
    ]
}
XWR = """\
radar:
  device: AWR1843
  frequency: 77.0
  idle_time: 7.0
  adc_start_time: 6.0
  ramp_end_time: 57.14
  tx_start_time: 1.0
  freq_slope: 29.982
  adc_samples: 128
  sample_rate: 10000
  frame_length: 64
  frame_period: 100
capture:
  sys_ip: 192.168.33.30
"""
INFINEON = {
    "device_config": {
        "fmcw_single_shape": {
            "rx_antennas": [1, 2, 3],
            "tx_antennas": [1],
            "start_frequency_Hz": 60_500_000_000,
            "end_frequency_Hz": 61_500_000_000,
            "sample_rate_Hz": 1_000_000,
            "num_samples_per_chirp": 64,
            "num_chirps_per_frame": 32,
            "chirp_repetition_time_s": 0.0005,
            "frame_repetition_time_s": 0.1,
        }
    }
}
PROFILE = {
    "start_frequency_hz": 77e9,
    "slope_hz_per_s": 29.982e12,
    "sample_rate_hz": 1e7,
    "ramp_period_s": 64.14e-6,
    "adc_start_s": 6e-6,
    "num_samples": 128,
}


def close(found: dict[str, Any], expected: dict[str, Any]) -> None:
    assert found == {
        name: pytest.approx(value, rel=1e-6) if isinstance(value, float) else value
        for name, value in expected.items()
    }


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        (
            "radar.cfg",
            CFG,
            PROFILE
            | {
                "format": "dca1000-xwr16xx",
                "num_ramps": 32,
                "num_antennas": 4,
                "num_transmitters": 2,
                "samples": "complex-1x",
            },
        ),
        (
            "setup.lua",
            LUA,
            PROFILE
            | {
                "format": "dca1000-xwr14xx",
                "ramp_period_s": 160e-6,
                "num_samples": 256,
                "num_ramps": 128,
                "num_antennas": 4,
                "antennas": "0,2",
                "num_transmitters": 2,
                "samples": "complex-2x",
            },
        ),
        (
            "a.mmwave.json",
            json.dumps(STUDIO),
            PROFILE
            | {
                "format": "dca1000-xwr16xx",
                "start_frequency_hz": 60e9,
                "num_ramps": 30,
                "num_antennas": 4,
                "num_transmitters": 3,
                "samples": "complex-1x",
            },
        ),
        (
            "xwr.yaml",
            XWR,
            PROFILE
            | {
                "format": "dca1000-xwr16xx",
                "num_ramps": 192,
                "num_antennas": 4,
                "num_transmitters": 3,
            },
        ),
        (
            "config.json",
            json.dumps(INFINEON),
            {
                "format": "npy",
                "start_frequency_hz": 60.5e9,
                "slope_hz_per_s": 1e9 / 64e-6,
                "sample_rate_hz": 1e6,
                "ramp_period_s": 5e-4,
                "num_samples": 64,
                "num_ramps": 32,
                "num_antennas": 3,
                "samples": "real",
                "axes": "frames,antennas,ramps,samples",
            },
        ),
    ],
)
def test_configurations_say_what_they_say(name: str, text: str, expected: Any) -> None:
    found = read_configuration(name, text)
    close(found.values, expected)
    parse_settings(found.values)
    assert all(said.source for said in found.settings.values())


def test_a_log_file_is_read_in_the_units_of_the_interface() -> None:
    found = read_configuration("LogFile.txt", LOG).values
    # Within half of the least significant bit
    assert found["start_frequency_hz"] == pytest.approx(77.00026e9, abs=1e4)
    assert found["slope_hz_per_s"] == pytest.approx(29.982e12, abs=0.025e12)
    assert found["ramp_period_s"] == pytest.approx(64.14e-6, abs=1e-11)
    assert found["adc_start_s"] == pytest.approx(6e-6)
    assert (found["num_samples"], found["num_ramps"], found["num_antennas"]) == (128, 32, 4)
    assert found["samples"] == "complex-2x"


def test_every_number_has_a_line_with_its_source() -> None:
    lines = list(lines_of(read_configuration("radar.cfg", CFG)))
    assert "slope_hz_per_s: 29.982 MHz/us  (profileCfg, line 6)" in lines
    assert any("idle time 7 us + ramp end 57.14 us" in line for line in lines)
    assert any("2 chirps in 16 loops of frameCfg, line 9" in line for line in lines)


def test_what_follows_is_said() -> None:
    settings = parse_settings(read_configuration("radar.cfg", CFG).values)
    radar = ChirpSequence(
        start_frequency_hz=77e9,
        slope_hz_per_s=29.982e12,
        sample_rate_hz=1e7,
        ramp_period_s=2 * 64.14e-6,
        num_samples=128,
        num_ramps=16,
        lowest_beat=0.0,
    )
    text = "\n".join(consequences(radar, settings))
    # B = k N / f_s, c / 2B, c f_s / 2k, c / (4 f T)
    assert "383.8 MHz" in text
    assert "cells of 0.3906 m, up to 50 m (Complex 1x)" in text
    assert "up to 7.588 m/s" in text
    assert "2 transmitters taking turns" in text


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (CFG.replace("57.14", "15"), "The ramp ends after 15 us, but adc start and 128 samples"),
        (
            CFG.replace(" 100 1 0", " 1 1 0"),
            "ramps of a frame last 2.05248 ms, its period is 1",
        ),
        (CFG.replace("chirpCfg 1 1 0", "chirpCfg 1 1 1"), "have the profiles 0, 1; 0 is read"),
        (CFG.replace("-1 0 1 0", "-1 1 1 0"), "adds headers to the stream"),
        ("% Range Resolution(m):0.2\n" + CFG, "range cells of 0.2 m; slope.* make 0.3906 m"),
    ],
)
def test_contradictions_are_remarked_with_both_derivations(text: str, words: str) -> None:
    (remark,) = read_configuration("radar.cfg", text).remarks
    assert re.search(words, remark)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.cfg", "frameCfg 0 0 16 0 100 1 0", "a.cfg holds no profile of a chirp"),
        ("a.cfg", "profileCfg 0 77 7", "profileCfg, line 1 holds 3 numbers; at least 11"),
        ("a.cfg", CFG.replace("29.982", "fast"), "line 6 has 'fast'; a number is needed"),
        ("a.cfg", CFG.replace("29.982", "1e300"), "a number below 1e"),
        ("a.cfg", CFG.replace("frameCfg 0 1", "frameCfg 5 1"), "chirps 5 to 1; they must lie"),
        ("a.lua", LUA.replace("SLOPE,", "OTHER,"), "line 4 has 'OTHER'; a number is needed"),
        ("a.json", '{"mmWaveDevices": [', "a.json is no JSON"),
        ("a.json", '{"mmWaveDevices": []}', "a.json holds no profile"),
        ("a.json", '{"fmcw_single_shape": {}}', "holds no start_frequency_Hz"),
        ("a.yaml", XWR.replace("  idle_time: 7.0\n", ""), "holds no idle_time"),
        ("a.yaml", XWR + "  num_tx: 1\n" + "radar: 5\n", "."),
        ("a.lua", "print(1)", "suffix '.lua'"),
    ],
)
def test_what_cannot_be_read_is_told_in_one_sentence(name: str, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        read_configuration(name, text)
    assert "\n" not in str(caught.value)


def test_later_files_count_and_arrays_keep_their_own_order() -> None:
    own = read_configuration("mine.json", '{"num_ramps": 8, "sign": "negative"}')
    both = merged({"radar.cfg": read_configuration("radar.cfg", CFG), "mine.json": own})
    assert both.values["num_ramps"] == 8
    assert both.values["slope_hz_per_s"] == 29.982e12
    array = for_recording(both, "cube.npy")
    assert array.values["format"] == "npy"
    assert "num_antennas" not in array.values
    assert for_recording(both, "adc_data.bin") == both


ONE_CHIRP_CFG = CFG.replace("frameCfg 0 1 16", "frameCfg 0 0 1")
ONE_CHIRP_SHAPE = INFINEON["device_config"]["fmcw_single_shape"] | {"num_chirps_per_frame": 1}


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("radar.cfg", ONE_CHIRP_CFG),
        ("config.json", json.dumps({"fmcw_single_shape": ONE_CHIRP_SHAPE})),
    ],
)
def test_a_chirp_a_frame_makes_ramps_of_frames(name: str, text: str) -> None:
    said = read_configuration(name, text)
    assert said.values["ramp_period_s"] == pytest.approx(0.1)
    assert "num_ramps" not in said.values
    assert any("sends one chirp a frame" in remark for remark in said.remarks)
    assert "one chirp a frame" in said.settings["ramp_period_s"].source


def test_of_several_arrays_the_largest_is_taken(tmp_path: Path) -> None:
    path = tmp_path / "radar.mat"
    savemat(path, {"radar": {"adc": np.ones((4, 8)), "fs": 1e7}})
    said = for_recording(read_configuration("mine.json", '{"format": "mat"}'), str(path))
    assert said.settings["key"] == Said("radar.adc", "the largest array of radar.mat")
    named = read_configuration("mine.json", '{"format": "mat", "key": "radar.fs"}')
    assert for_recording(named, str(path)) == named
