"""The kinds of cases of the blind check, in the order in which they are drawn."""

KINDS = ('null', 'single', 'removed', 'foreign', 'pair', 'triple')
