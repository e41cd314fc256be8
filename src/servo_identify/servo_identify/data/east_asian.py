"""Words of Chinese, Japanese and Korean for columns and units, and the letters of such files."""

from __future__ import annotations

import re
import unicodedata

from .european import is_cyrillic

LETTERS = ('gb18030', 'cp932', 'big5', 'cp949')
"""Encodings of files that are not in Unicode: mainland China, Japan, Taiwan, Korea."""
_NAMES = {
    'time': '时间 時間 时刻 時刻 タイムスタンプ 时间戳 시간', 'voltage': '电压 電壓 電圧 전압',
    'current': '电流 電流 전류',
    'position': '位置 위치', 'angle': '角度 转角 轉角 角位移 回転角 각도',
    'velocity': '速度 转速 轉速 回転数 角速度 속도 각속도 회전수',
    'acceleration': '加速度 角加速度 가속도 각가속도', 'torque': '转矩 轉矩 扭矩 力矩 トルク 토크',
    'motor': '电机 電機 马达 馬達 モーター モータ 모터 전동기',
    'load': '负载 負載 負荷 输出 輸出 부하 출력', 'joint': '关节 關節 関節 관절',
    'encoder': '编码器 編碼器 エンコーダー エンコーダ 엔코더', 'command': '指令 命令 명령 지령',
    'target': '目标 目標 给定 給定 设定 設定 期望 参考 목표', 'error': '误差 誤差 偏差 오차',
    'bus': '母线 母線', 'temperature': '温度 溫度 온도', 'measured': '测量 測量 实测 측정',
    'sensor': '传感器 感測器 センサ 센서',
}
_UNITS = {
    'ms': '毫秒 ミリ秒 밀리초', 'us': '微秒 マイクロ秒 마이크로초', 's': '秒 초', 'mV': '毫伏',
    'V': '伏特 伏 ボルト 볼트', 'mA': '毫安 밀리암페어', 'A': '安培 安 アンペア 암페어',
    'rad': '弧度 ラジアン 라디안', 'deg': '度 도', 'min': '分钟 分 분',
    'rev': '转 轉 圈 回転 회전',
    'N': '牛顿 牛 뉴턴', 'mm': '毫米', 'm': '米 미터', 'counts': '脉冲 脈衝 パルス 펄스',
}


def _table(words: dict[str, str]) -> tuple[re.Pattern[str], dict[str, str]]:
    of = {word: english for english, several in words.items() for word in several.split()}
    return re.compile('|'.join(sorted(of, key=len, reverse=True))), of


_NAME, _UNIT = _table(_NAMES), _table(_UNITS)


def names_in_english(text: str) -> str:
    """Return a name with its words of these languages in English; others stay as they are."""
    pattern, of = _NAME
    text = unicodedata.normalize('NFKC', text)  # katakana of half width, letters in parts
    return pattern.sub(lambda found: f' {of[found[0]]} ', text)


def units_in_symbols(text: str) -> str:
    """Return a unit with the symbols for its words of Chinese, Japanese or Korean."""
    pattern, of = _UNIT
    return pattern.sub(lambda found: f' {of[found[0]]} ', text).strip()


def letters_of(begin: bytes) -> str:
    """
    Return the encoding in which a file that is not in Unicode holds such words, or ''.

    The letters may be Cyrillic ones of Windows as well.
    """
    for encoding in LETTERS:
        try:
            begin.decode(encoding)
        except UnicodeDecodeError as problem:
            if problem.start < len(begin) - 4:  # not cut inside a letter
                continue
        if _NAME[0].search(begin.decode(encoding, 'ignore')):
            return encoding
    return 'cp1251' if is_cyrillic(begin.decode('cp1251', 'ignore')) else ''
