"""Words of Chinese and Japanese for columns and units, and the letters that such files are in."""

from __future__ import annotations

import re

LETTERS = ('gb18030', 'cp932', 'big5')
"""Encodings of files that are not in Unicode: mainland China, Japan, Taiwan."""
_NAMES = {
    'time': '时间 時間 时刻 時刻', 'voltage': '电压 電壓 電圧', 'current': '电流 電流',
    'position': '位置', 'angle': '角度 转角 轉角 角位移',
    'velocity': '速度 转速 轉速 回転数 角速度',
    'acceleration': '加速度 角加速度', 'torque': '转矩 轉矩 扭矩 力矩 トルク',
    'motor': '电机 電機 马达 馬達 モーター モータ', 'load': '负载 負載 負荷 输出 輸出',
    'joint': '关节 關節 関節', 'encoder': '编码器 編碼器 エンコーダー エンコーダ',
    'command': '指令 命令', 'target': '目标 目標 给定 給定 设定 設定 期望 参考',
    'error': '误差 誤差 偏差', 'bus': '母线 母線', 'temperature': '温度 溫度',
    'measured': '测量 測量 实测', 'sensor': '传感器 感測器 センサ',
}
_UNITS = {
    'ms': '毫秒 ミリ秒', 'us': '微秒 マイクロ秒', 's': '秒', 'mV': '毫伏', 'V': '伏特 伏 ボルト',
    'mA': '毫安', 'A': '安培 安 アンペア', 'rad': '弧度 ラジアン', 'deg': '度', 'min': '分钟 分',
    'rev': '转 轉 圈 回転', 'N': '牛顿 牛', 'mm': '毫米', 'm': '米', 'counts': '脉冲 脈衝 パルス',
}


def _table(words: dict[str, str]) -> tuple[re.Pattern[str], dict[str, str]]:
    of = {word: english for english, several in words.items() for word in several.split()}
    return re.compile('|'.join(sorted(of, key=len, reverse=True))), of


_NAME, _UNIT = _table(_NAMES), _table(_UNITS)


def names_in_english(text: str) -> str:
    """Return a name with its words of Chinese or Japanese in English; others stay as they are."""
    pattern, of = _NAME
    return pattern.sub(lambda found: f' {of[found[0]]} ', text)


def units_in_symbols(text: str) -> str:
    """Return a unit with the symbols for its words of Chinese or Japanese."""
    pattern, of = _UNIT
    return pattern.sub(lambda found: f' {of[found[0]]} ', text).strip()


def letters_of(begin: bytes) -> str:
    """Return the encoding in which a file that is not in Unicode holds such words, or ''."""
    for encoding in LETTERS:
        try:
            begin.decode(encoding)
        except UnicodeDecodeError as problem:
            if problem.start < len(begin) - 4:  # not cut inside a letter
                continue
        if _NAME[0].search(begin.decode(encoding, 'ignore')):
            return encoding
    return ''
