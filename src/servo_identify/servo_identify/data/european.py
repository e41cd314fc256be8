"""Words of European languages for columns and units, as loggers and people write them."""

from __future__ import annotations

import re
import unicodedata

_NAMES = {
    'time': 'zeit temps tempo tiempo tijd tid czas čas aika zaman время '
            'horodatage heure hora',
    'voltage': 'spannung tension tensione tensión tensão voltaje voltaggio voltagem spanning '
               'spänning spænding napięcie napětí jännite gerilim напряжение',
    'current': 'strom courant intensité corrente corriente intensidad stroom ström strøm prąd '
               'proud virta akım ток',
    'position': 'lage posizione posición posição positie pozycja poloha asento konum положение '
                'позиция',
    'angle': 'winkel angolo ángulo ângulo hoek vinkel kąt úhel kulma açı угол',
    'velocity': 'drehzahl geschwindigkeit vitesse velocità velocidad velocidade snelheid '
                'hastighet hastighed varvtal prędkość rychlost nopeus hız скорость',
    'acceleration': 'beschleunigung accélération accelerazione aceleración aceleração '
                    'versnelling ускорение',
    'torque': 'drehmoment couple coppia par binário koppel vridmoment vääntömomentti tork '
              'момент',
    'force': 'kraft forza fuerza força kracht siła síla voima kuvvet сила',
    'motor': 'moteur motore silnik moottori двигатель двигателя',
    'load': 'last abtrieb abtriebs belasting charge carico carga sortie uscita salida saída '
            'kuorma yük нагрузка нагрузки',
    'joint': 'gelenk articulation giunto articulación articulação gewricht сустав',
    'encoder': 'encodeur codeur codificador энкодер',
    'target': 'soll consigne riferimento consigna referencia referência referentie börvärde '
              'задание',
    'actual': 'ist réel réelle reale',
    'measured': 'gemessen mess mesure mesuré mesurée misura misurato misurata medida medido '
                'gemeten uppmätt',
    'command': 'befehl commande comando mando команда',
    'error': 'fehler abweichung erreur errore erro fout fel ошибка',
    'bus': 'zwischenkreis alimentation alimentazione alimentación alimentação',
    'temperature': 'temperatur température temperatura temperatuur lämpötila sıcaklık '
                   'температура',
}
_UNITS = {
    's': 'sek sekunde sekunden seconde secondes secondi secondo seg segundo segundos сек с',
    'ms': 'millisekunden milliseconde millisecondes millisecondi milisegundos мс',
    'us': 'mikrosekunden microsecondes microsecondi microsegundos мкс',
    'V': 'voltio voltios вольт в', 'mV': 'мв', 'A': 'ampère ampères amperio amperios ампер а',
    'mA': 'ма', 'rad': 'radianti radiante radianes radiano radianos рад',
    'deg': 'grad degré degrés grado grados gradi graus graden grader град',
    'rev': 'umdr tr tour tours giro giri vuelta vueltas volta voltas об',
    'min': 'мин minute minuten minutes minuto minutos minuti',
}
_PARTS = ('wert', 'stell', 'schlepp', 'dreh', 'positions', 'gehäuse', 'uhr', 'stempel')
"""Further parts of words that are written as one."""
_SPLIT = 3  # letters from which on a word may be a part of a longer one


def bare(text: str) -> str:
    """Return a text in small letters and without accents."""
    parted = unicodedata.normalize('NFKD', text.lower())
    return ''.join(letter for letter in parted if not unicodedata.combining(letter))


def _of(words: dict[str, str]) -> dict[str, str]:
    return {bare(word): english for english, several in words.items() for word in several.split()}


_NAME, _UNIT = _of(_NAMES), _of(_UNITS)
_ONE = '|'.join(sorted({one for one in (*_NAME, *_NAMES, *map(bare, _PARTS))
                        if len(one) >= _SPLIT}, key=len, reverse=True))
_COMPOUND = re.compile(f'(?:{_ONE})+')


def words_in_english(word: str) -> list[str]:
    """
    Return a word in English, and the parts of one that is made of several: Motorstrom.

    ``word`` has small letters and no accents, as :func:`bare` makes it. One that is not known
    stays as it is.
    """
    if word in _NAME:
        return [_NAME[word]]
    parts = re.findall(_ONE, word) if _COMPOUND.fullmatch(word) else [word]
    return [_NAME.get(part, part) for part in parts]


def symbols_of(text: str) -> str:
    """Return a unit with the symbols for its words: tr/min is rev/min. Others stay."""
    # º is what a keyboard of Spain or Italy has for °
    return re.sub(r'[^\W\d_]+', lambda found: _symbol(found[0]), text.replace('º', '°'))


def _symbol(word: str) -> str:
    """Return the symbol of a word; what is written in Latin letters is one from two on."""
    plain = bare(word)
    return _UNIT[plain] if plain in _UNIT and not (plain == word and len(word) < 2 and
                                                   word.isascii()) else word


def is_cyrillic(text: str) -> bool:
    """Tell whether one of the words of this table stands in a text in Cyrillic letters."""
    return any(word in _NAME and not word.isascii() for word in re.findall(r'\w+', bare(text)))
