"""Configurations in JSON: ``*.mmwave.json`` of mmWave Studio, ``config.json`` of Infineon's SDK.

The former holds ``rlProfileCfg_t``, ``rlChirpCfg_t`` and ``rlFrameCfg_t`` of its devices, the
latter ``fmcw_single_shape``: start and end frequency of the sampled part of a chirp, the number of
its samples and their rate. Infineon's 60 GHz sensors have real, unsigned samples, which their SDK
saves as an array (frames, antennas, ramps, samples).
"""

import json
from collections.abc import Mapping
from typing import Any

from vsep.errors import InputError
from vsep.recordings.configurations.configuration import ONE_CHIRP, Configuration, Said, number
from vsep.recordings.configurations.ti_setup import Chirp, TiProfile, TiSetup
from vsep.recordings.settings import REAL

_SHAPE = "fmcw_single_shape"
_STUDIO = "mmWaveDevices"


def is_studio_json(_name: str, text: str) -> bool:
    """Whether a text is a configuration of mmWave Studio."""
    return f'"{_STUDIO}"' in text


def is_infineon_json(_name: str, text: str) -> bool:
    """Whether a text is a configuration of Infineon's SDK."""
    return f'"{_SHAPE}"' in text


def read_studio_json(name: str, text: str) -> Configuration:
    """Read a configuration of mmWave Studio, its first device.

    Raises `InputError` if it is damaged or holds no profile.
    """
    devices = _parsed(name, text).get(_STUDIO)
    device = devices[0] if isinstance(devices, list) and devices else {}
    setup = TiSetup(name)
    radio = _group(device, "rfConfig")
    for stored in _list(radio, "rlProfiles"):
        _take_profile(setup, _group(stored, "rlProfileCfg_t"))
    for stored in _list(radio, "rlChirps"):
        values = _group(stored, "rlChirpCfg_t")
        setup.chirps.append(
            Chirp(
                first=_whole(setup, values, "chirpStartIdx"),
                last=_whole(setup, values, "chirpEndIdx"),
                profile=_whole(setup, values, "profileId"),
                transmitters=_whole(setup, values, "txEnable"),
            )
        )
        setup.chirps_source = "rlChirpCfg_t"
    frame = _group(radio, "rlFrameCfg_t")
    if frame:
        first, last, loops = (
            _whole(setup, frame, key) for key in ("chirpStartIdx", "chirpEndIdx", "numLoops")
        )
        setup.frame, setup.frame_source = (first, last, loops), "rlFrameCfg_t"
        setup.frame_period_s = number(name, frame.get("framePeriodicity_msec", 0), "period") * 1e-3
    channels = _group(radio, "rlChanCfg_t")
    if "rxChannelEn" in channels:
        setup.receivers = Said(_whole(setup, channels, "rxChannelEn"), "rlChanCfg_t")
    kind = _group(_group(radio, "rlAdcOutCfg_t"), "fmt")
    if "b2AdcOutFmt" in kind:
        setup.sample_kind = Said(_whole(setup, kind, "b2AdcOutFmt"), "rlAdcOutCfg_t")
    part = device.get("partNumber") or _group(device, "mmWaveDeviceConfig").get("mmWaveDevice")
    if isinstance(part, str):
        setup.device = Said(part[:40], "partNumber")
    return setup.configuration()


def _take_profile(setup: TiSetup, values: Mapping[str, Any]) -> None:
    def of(key: str) -> float:
        if key not in values:
            raise InputError(f"{setup.name}: rlProfileCfg_t holds no {key}, which is needed.")
        return number(setup.name, values[key], key)

    which = int(number(setup.name, values.get("profileId", 0), "profileId"))
    setup.profiles[which] = TiProfile(
        number=which,
        start_frequency_ghz=of("startFreqConst_GHz"),
        idle_us=of("idleTimeConst_usec"),
        adc_start_us=of("adcStartTimeConst_usec"),
        ramp_end_us=of("rampEndTime_usec"),
        slope_mhz_per_us=of("freqSlopeConst_MHz_usec"),
        num_samples=int(of("numAdcSamples")),
        sample_rate_ksps=of("digOutSampleRate"),
        source=f"rlProfileCfg_t {which}",
    ).in_si()


def read_infineon_json(name: str, text: str) -> Configuration:
    """Read a configuration of Infineon's SDK.

    Raises `InputError` if it is damaged or lacks a value.
    """
    stored = _parsed(name, text)
    values = _group(_group(stored, "device_config"), _SHAPE) or _group(stored, _SHAPE)

    def of(*keys: str) -> float:
        for key in keys:
            if key in values:
                return number(name, values[key], key)
        raise InputError(f"{name}: {_SHAPE} holds no {keys[0]}, which is needed.")

    start, end = (
        of("start_frequency_Hz", "lower_frequency_Hz"),
        of("end_frequency_Hz", "upper_frequency_Hz"),
    )
    rate, count = of("sample_rate_Hz"), of("num_samples_per_chirp")
    if rate <= 0.0 or count < 1.0:
        raise InputError(f"{name}: {count:g} samples at {rate:g} Hz; both must be positive.")
    antennas = values.get("rx_antennas")
    num_antennas = len(antennas) if isinstance(antennas, list) else 1
    sampled_s = count / rate
    period_s, num_ramps = of("chirp_repetition_time_s"), int(of("num_chirps_per_frame"))
    frame_period_s = number(name, values.get("frame_repetition_time_s", 0.0), "frame period")
    remarks = [
        f"The slope is {end - start:.6g} Hz over {count:g} samples at {rate:g} Hz; a chirp sweeps "
        "a little more, since the synthesizer settles before its first sample."
    ]
    if sampled_s > period_s:
        remarks.append(
            f"{count:g} samples at {rate:g} Hz take {sampled_s:.3g} s, but chirps repeat after "
            f"{period_s:.3g} s: one of them is wrong."
        )
    period = Said(period_s, "chirp_repetition_time_s")
    axes, ramps = (
        "frames,antennas,ramps,samples",
        {"num_ramps": Said(num_ramps, "num_chirps_per_frame")},
    )
    if num_ramps == 1 and frame_period_s > period_s:
        axes, ramps = "ramps,antennas,frames,samples", {}
        period = Said(frame_period_s, "one chirp a frame: frame_repetition_time_s")
        remarks.append(ONE_CHIRP)
    return Configuration(
        {
            "format": Said("npy", "assumed: the array radar.npy of Infineon's SDK"),
            "start_frequency_hz": Said(start, "start_frequency_Hz"),
            "slope_hz_per_s": Said(
                (end - start) / sampled_s, "end minus start frequency over the sampled time"
            ),
            "sample_rate_hz": Said(rate, "sample_rate_Hz"),
            "ramp_period_s": period,
            "num_samples": Said(int(count), "num_samples_per_chirp"),
            **ramps,
            "num_antennas": Said(num_antennas, "rx_antennas"),
            "samples": Said(REAL, "Infineon's 60 GHz sensors have one mixer a receiver"),
            "axes": Said(axes, "as Infineon's SDK saves them"),
        },
        tuple(remarks),
    )


def _parsed(name: str, text: str) -> Mapping[str, Any]:
    try:
        stored = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{name} is no JSON; a configuration is needed.") from error
    return stored if isinstance(stored, dict) else {}


def _group(stored: Any, key: str) -> Mapping[str, Any]:
    inner = stored.get(key) if isinstance(stored, Mapping) else None
    return inner if isinstance(inner, Mapping) else {}


def _list(stored: Mapping[str, Any], key: str) -> list[Any]:
    inner = stored.get(key)
    return inner if isinstance(inner, list) else []


def _whole(setup: TiSetup, values: Mapping[str, Any], key: str) -> int:
    return int(number(setup.name, values.get(key, 0), key))
