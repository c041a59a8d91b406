"""Teaches the robot to pronounce a name, in all its voices, and writes the result into files."""

import argparse

import qi


def main(session):
    tts = session.service("ALTextToSpeech")
    language = tts.getLanguage()
    print("languages:", ", ".join(tts.getAvailableLanguages()))
    print("voices:", ", ".join(tts.getAvailableVoices()))
    tts.setVolume(1.5)
    print("volume:", tts.getVolume())
    tts.setLanguage("English")
    tts.setVoice("naoenu")
    tts.sayToFile("Nao", "/home/nao/before.wav")
    print("added:", tts.addToDictionary("Nao", "\\toi=lhp\\ now or never \\toi=orth\\"))
    tts.sayToFile("Nao", "/home/nao/after.wav")
    tts.say("\\rspd=300\\ Nao")
    print("deleted:", tts.deleteFromDictionary("Nao"), tts.deleteFromDictionary("Nao"))
    try:
        tts.setLanguage("Klingon")
    except RuntimeError as error:
        print("error:", str(error).strip().splitlines()[-1])
    tts.setLanguage(language)
    tts.setVolume(0.55)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--qi-url", type=str, default="tcp://127.0.0.1:9559")
    arguments, _ = parser.parse_known_args()
    session = qi.Session()
    session.connect(arguments.qi_url)
    main(session)
