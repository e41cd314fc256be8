"""Nothing that comes from outside is run: no eval, pickle, unsafe YAML or shell in the sources."""

import ast
from pathlib import Path

import pytest
import yaml

from servo_twin.bag.message_sources import BagError, open_source
from servo_twin.description.strict_yaml import NotPlain, read_yaml

SRC = Path(__file__).resolve().parents[2] / 'src'
MODULES = sorted(SRC.glob('*/servo_*/**/*.py'))
RUNNING = {'eval', 'exec', 'compile', '__import__'}
SERIALISERS = {'pickle', 'cPickle', 'dill', 'cloudpickle', 'marshal', 'shelve', 'joblib'}
YAML_LOADERS = {'unsafe_load', 'full_load', 'unsafe_load_all', 'full_load_all', 'load_all'}
SAFE_LOADERS = {'_Loader'}  # subclasses of SafeLoader, see the test below
RUNS_WHAT_A_PERSON_NAMES = {
    'exec_module': {'physics/catalogue.py',  # --effects
                    'physics/kernel.py', 'balances/controller_law.py'},  # what we wrote ourselves
}


def unsafe(tree: ast.AST, where: str = '') -> list[str]:
    """Return what a module does that could run what it reads, each as one sentence."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [one.name for one in node.names] + [getattr(node, 'module', None) or '']
            found += [f'line {node.lineno} imports {name}' for name in names
                      if name.partition('.')[0] in SERIALISERS]
        if not isinstance(node, ast.Call):
            continue
        name = node.func.id if isinstance(node.func, ast.Name) else ''
        attribute = node.func.attr if isinstance(node.func, ast.Attribute) else ''
        owner = node.func.value.id if isinstance(getattr(node.func, 'value', None),
                                                 ast.Name) else ''
        keywords = {one.arg: one.value for one in node.keywords}
        if name in RUNNING:
            found.append(f'line {node.lineno} calls {name}')
        if owner == 'yaml' and (attribute in YAML_LOADERS or attribute == 'load' and not (
                len(node.args) == 2 and getattr(node.args[1], 'id', '') in SAFE_LOADERS
                or len(node.args) == 1 and not keywords and where.endswith('patch.py'))):
            found.append(f'line {node.lineno} calls yaml.{attribute}')
        if getattr(keywords.get('allow_pickle'), 'value', False):
            found.append(f'line {node.lineno} allows pickle')
        if getattr(keywords.get('shell'), 'value', False) or (owner, attribute) == (
                'os', 'system'):
            found.append(f'line {node.lineno} starts a shell')
        if attribute == 'exec_module' and not any(
                where.endswith(one) for one in RUNS_WHAT_A_PERSON_NAMES['exec_module']):
            found.append(f'line {node.lineno} runs a file')
    return found


@pytest.mark.parametrize('package', sorted({path.relative_to(SRC).parts[0] for path in MODULES}))
def test_no_module_runs_what_it_reads(package):
    told = [f'{path.relative_to(SRC)}: {one}' for path in MODULES
            if path.relative_to(SRC).parts[0] == package
            for one in unsafe(ast.parse(path.read_text()), path.as_posix())]
    assert told == []


@pytest.mark.parametrize('text', [
    'eval(text)', 'exec(text)', 'import pickle', 'from joblib import load', 'yaml.load(text)',
    'yaml.load(text, yaml.UnsafeLoader)', 'yaml.full_load(text)', 'np.load(f, allow_pickle=True)',
    'subprocess.run(text, shell=True)', 'os.system(text)', 'spec.loader.exec_module(module)'])
def test_it_catches_what_is_planted(text):
    assert len(unsafe(ast.parse(text), 'servo_twin/bag/reading.py')) == 1


@pytest.mark.parametrize('text', [
    'yaml.safe_load(text)', 'np.load(f, allow_pickle=False)', 'net.eval()', 're.compile(text)',
    'subprocess.run([a, b])'])
def test_it_lets_pass_what_is_harmless(text):
    assert unsafe(ast.parse(text)) == []


@pytest.mark.parametrize('text', [
    '!!python/object/apply:os.system ["true"]', '!!python/name:os.system', 'a: &x 1\nb: *x',
    'a: 1\na: 2', '[' * 40 + ']' * 40])
def test_yaml_from_outside_makes_no_objects(text):
    with pytest.raises(yaml.YAMLError):
        read_yaml(text)
    assert issubclass(NotPlain, yaml.YAMLError)


def test_a_bag_that_names_a_file_outside_itself_does_not_have_it_read(tmp_path):
    (tmp_path / 'other.mcap').write_bytes(b'')
    (tmp_path / 'bag').mkdir()
    for name in ('../other.mcap', str(tmp_path / 'other.mcap')):
        (tmp_path / 'bag' / 'metadata.yaml').write_text(
            f'rosbag2_bagfile_information: {{relative_file_paths: [{name}]}}')
        with pytest.raises(BagError, match='has no .mcap file'):
            open_source(tmp_path / 'bag')


def test_every_loader_of_yaml_is_a_safe_one():
    from servo_twin.bag import metadata_file
    from servo_twin.description import strict_yaml

    safe = (yaml.SafeLoader, getattr(yaml, 'CSafeLoader', yaml.SafeLoader))
    assert issubclass(strict_yaml._Loader, safe) and issubclass(metadata_file._Loader, safe)
