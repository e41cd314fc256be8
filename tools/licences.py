"""Prints the licence of every package in the environment: `make licences`."""

from importlib.metadata import distributions

UNTOLD = '(none told; see the package)'


def licence_of(metadata) -> str:
    """Return what a package says of its licence: expression, classifier or text, in that order."""
    if metadata.get('License-Expression'):
        return metadata['License-Expression']
    told = [line.rpartition(' :: ')[2] for line in metadata.get_all('Classifier') or ()
            if line.startswith('License ::')]
    first = (metadata.get('License') or '').strip().splitlines()[:1]
    return ', '.join(sorted(set(told))) or (first[0][:60] if first else UNTOLD)


def main() -> None:
    """Print name, version and licence, in the order of the names."""
    rows = sorted({(one.metadata['Name'].lower(), one.version, licence_of(one.metadata))
                   for one in distributions() if one.metadata['Name']})
    wide = max(len(name) for name, _, _ in rows)
    for name, number, licence in rows:
        print(f'{name:{wide}}  {number:14} {licence}')
    told = sum(licence == UNTOLD for _, _, licence in rows)
    print(f'{len(rows)} packages, {told} of them tell no licence')


if __name__ == '__main__':
    main()
