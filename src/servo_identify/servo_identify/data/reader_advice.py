"""What to do about a warning of the reader of a table."""

READER = {
    'not even': 'record at a fixed rate where you can; on such rows the controller is not judged',
    'off the grid': 'nothing; else look at the link that lost them',
    'of its round': 'record faster, or cut the table there',
    'jump from end to end': 'give the round of the encoder as wraps in the mapping',
    'newest first': 'nothing, where that is so; else look at the clock of the logger',
    'repeat the time': 'look at the clock of the logger; nothing else has to be done',
    'sampled less often': 'join: true in a mapping file holds a command and interpolates angles',
    's of the header': 'nothing, where no row is missing',
    'begins in row': 'nothing, where it was sent from then on',
    'missing in': 'look at the link that lost them; rows without a number are not used',
    'holes of': 'look at the logger; rows in holes are not used',
    'times of their own': 'nothing where that is fine enough; else export with one time for all',
    'which has most rows of numbers': 'nothing, where that is the sheet; else rows: NAME',
    'is unusual; is t in': 'give the unit of the time in the header or the mapping, as in t [ms]',
    'breaks off': 'nothing, where the logger was stopped in its last line',
    'there is no voltage': 'record what the drive received',
    'go back by': 'cut the recording there, or record again with one publisher and a steady clock',
    'taken on by their receipt': 'nothing, where receipts are not late; else cut it there',
    'another clock': 'nothing, where receipts are not late; a header with a stamp is better',
    'rows end before': 'nothing, where nobody filled that column',
    'and is left out': 'nothing, where it was broken off; else record it again',
    'the drive is off': 'nothing, where it was meant to be off',
}
"""Words of a warning of the reader, and what to do about it."""
