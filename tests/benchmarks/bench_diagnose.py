"""
How long a diagnosis takes, what dominates, and how much memory it needs.

    python tests/benchmarks/bench_diagnose.py [SECONDS [REPORT.html]]

Three replicates of five families of the emulated bench, SECONDS (30) each, at 1 kHz, against the
servo file that lacks most of what the rig does: five screen, five accept, five report. The whole
catalogue takes part. Beside the time stands that of the processors, which other work on the
machine changes less, and the length of the recordings. The page of the report is written where it
is asked for.
"""

from pathlib import Path
import resource
import sys
import tempfile
import time

from speed_table import row

FAMILIES = {
    'speed_ladder': {'lowest': 0.02, 'highest': 1.0, 'steps': 4},
    'slow_reversals': {'amplitude': 0.05, 'period': 4.0},
    'load_steps': {'speed': 0.2, 'torque': 60.0, 'steps': 3},
    'multisine': {'amplitude': 4.0, 'first': 0.25, 'last': 25.0},
    'turns': {'speed': 1.2},
}


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 30.0
    from servo_identify.diagnose.diagnose import diagnose
    from servo_studies.blind_check.fault_tables import config_folder
    from servo_studies.blind_check.rig_recordings import make_bags
    from servo_twin.bag import read_recording
    from servo_twin.description import servo_file

    config = config_folder()
    servo_path = config / 'servos' / 'rv_bench.yaml'
    with tempfile.TemporaryDirectory() as folder:
        orders = [{'name': f'{family}-{n}', 'family': family, 'settings': settings,
                   'rig': str(config / 'rigs' / 'rv_bench.yaml'), 'duration': seconds, 'set': {},
                   'seed': 10 * n + i, 'replicate': n}
                  for n in (1, 2, 3) for i, (family, settings) in enumerate(FAMILIES.items())]
        print(f'recording {len(orders)} times {seconds:g} s ...', flush=True)
        bags = make_bags(orders, servo_path, Path(folder))
        recordings = [read_recording(bag) for bag in bags]
        servo = servo_file.load(servo_path)
        screen, accept, report = recordings[:5], recordings[5:10], recordings[10:]
        began, work = time.perf_counter(), time.process_time()
        found = diagnose(screen, servo, accept, report)
        took, work = time.perf_counter() - began, time.process_time() - work
        print(f'{took:.1f} s, {work:.1f} s of processors; the five screened recordings last '
              f'{5 * seconds:g} s, {5 * seconds / took:.1f} times as long')
        for stage, part in sorted(found.report.timing.items(), key=lambda e: -e[1]):
            print(f'    {stage:<14}{part:7.1f} s  {100 * part / took:4.0f} %')
        print(found.report.verdict['sentence'])
        if len(sys.argv) > 2:
            from servo_identify.diagnose.page.document import document_of
            from servo_identify.diagnose.page.page import write_page
            write_page(document_of(found, '', ' '.join(sys.argv)), Path(sys.argv[2]))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0**2
    print(f'memory at most {peak:.2f} GB')
    row(f'diagnosis of five recordings of {seconds:g} s, ten more to judge by',
        f'{took:.0f} s, {work:.0f} s of processors; {peak:.1f} GB, recording included',
        'goal 30 s, 1.5 GB', 30.0 / took)


if __name__ == '__main__':
    main()
