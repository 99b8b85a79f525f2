"""python -m warpsim VERB …"""

from warpsim.cli import live

if __name__ == "__main__":
    live()
