"""What polled averages tell: drives on the simulator's switches, polled as a vendor's tool does, fitted by the command.

Truth is the machine's at one temperature, on switches without resistance; within: two stated deviations.
"""
import argparse
import json
import subprocess
import sys
import tempfile
import tomllib

MACHINES = {"servo": ("drive_clamped", 150), "joint": ("drive_clamped_joint", 90),
            "hub": ("drive_compensated_hub", 45), "fast": ("drive_compensated_fast", 300)}
# Speed over the top speed: wave, its period in s, random part, its hold in s; the load's hold in s.
PROFILES = {"steps": (0, 1, 0.9, 2, 1.3), "ride": (0.6, 8, 0.3, 0.5, 0.5), "osc": (0.8, 0.7, 0, 1, 0.3)}
NAMES = ("R_ohm", "psi_Wb", "Lq_H")


def settings(top, profile):
    wave, period_s, random, hold_s, load_s = PROFILES[profile]
    speed = "profile.speed_rad_s"
    values = {f"{speed}.wave": wave * top, f"{speed}.wave_period_s": period_s, f"{speed}.random": random * top,
              f"{speed}.random_hold_s": hold_s, "profile.load_Nm.random_hold_s": load_s,
              "inverter.switch_ohm": 0, "inverter.diode_ohm": 0, "nonideal.winding_alpha_per_K": 0,
              "nonideal.magnet_beta_per_K": 0}
    return [word for key, value in values.items() for word in ("--set", f"{key}={value}")]


def fitted(command, machine, profile, rate, seed, seconds, folder):
    scenario, top = MACHINES[machine]
    subprocess.run([command, "sim", scenario, "--polled", str(rate), "--seed", str(seed), "--out", folder, "--set",
                    f"duration_s={seconds}", *settings(top, profile)], check=True, stdout=subprocess.DEVNULL)
    with open(f"{folder}/{scenario}.toml", "rb") as file:
        truth = tomllib.load(file)["machine"]
    run = subprocess.run([command, "fit", "--json", f"{folder}/{scenario}.csv"], capture_output=True, text=True)
    return truth, json.loads(run.stdout)["parameters"] if run.stdout else {}


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("command", help="build/dqwatch")
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--seconds", type=float, default=30)
    arguments.add_argument("--rates", default="10,20,50,200")
    arguments.add_argument("--machines", default=",".join(MACHINES))
    arguments.add_argument("--profiles", default=",".join(PROFILES))
    a = arguments.parse_args()
    counts = {name: [0, 0, 0, 0] for name in NAMES}
    print("| machine, profile, Hz | R | psi | L_q |\n| --- | --- | --- | --- |")
    for machine in a.machines.split(","):
        for profile in a.profiles.split(","):
            for rate in a.rates.split(","):
                with tempfile.TemporaryDirectory() as folder:
                    truth, found = fitted(a.command, machine, profile, rate, a.seed, a.seconds, folder)
                cells = []
                for name in NAMES:
                    if name not in found:
                        cells.append("not known")
                        continue
                    error, sd = (100 * (found[name]["value"] / truth[name] - 1), 100 * found[name]["sd"] / truth[name])
                    within, usable = abs(error) <= 2 * sd, found[name]["usable"]
                    counts[name] = [n + m for n, m in zip(counts[name], (1, within, usable, within and usable))]
                    cells.append(f"{error:+.2f} ± {sd:.2f} %{'' if usable else ' (not usable)'}")
                print(f"| {machine} {profile} {rate} | {' | '.join(cells)} |", flush=True)
    for name, (known, within, usable, both) in counts.items():
        print(f"{name}: {within} of {known} within two deviations, {both} of {usable} usable ones")


if __name__ == "__main__":
    sys.exit(main())
