"""Waits for a QR code before the robot, and says what it reads."""

import argparse
import time

import qi


def main(session):
    memory = session.service("ALMemory")
    barcode_reader = session.service("ALBarcodeReader")
    barcode_reader.subscribe("test_barcode")
    data = None
    for _ in range(100):
        data = memory.getData("BarcodeReader/BarcodeDetected")
        if data:
            break
        time.sleep(0.1)
    barcode_reader.unsubscribe("test_barcode")
    for code in data or []:
        text, corners = code
        print("code: " + text)
        print("corners: " + " ".join(f"{round(x)},{round(y)}" for x, y in corners))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--qi-url", type=str, default="tcp://127.0.0.1:9559")
    args = parser.parse_args()
    session = qi.Session()
    session.connect(args.qi_url)
    main(session)
